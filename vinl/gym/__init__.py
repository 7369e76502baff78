"""The environments of gymnasium: importing this package registers ``vinl/Home-v0`` and ``vinl/Nav-v0``.

``import vinl`` does so if gymnasium was imported before; ``gymnasium.make("vinl.gym:vinl/Home-v0")`` in any order.
"""

from typing import Any

import gymnasium

ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "vinl/Home-v0": {"entry_point": "vinl.gym.home:HomeEnv"},
    "vinl/Nav-v0": {"entry_point": "vinl.nav.gym:NavEnv", "vector_entry_point": "vinl.nav.gym:NavVectorEnv"},
}
"""Name and place of each; nothing but the names is imported before an environment is made."""

for _name, _where in ENVIRONMENTS.items():
    if _name not in gymnasium.registry:
        gymnasium.register(_name, **_where)
