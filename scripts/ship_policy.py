"""Copy the policy of a training run to the policies that travel with the package.

    python scripts/ship_policy.py runs/nav nav --half --from runs/nav-first --commit HASH

Paths of the machine that trained it stay out of the card: of files of floor plans only the name is kept, and what the
run started from is named by --from. Trainings behind it that ship themselves are named as they ship: ship them first.
Measure it afterwards (scripts/measure_policy.py).
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

from vinl.config.paths import assets_dir
from vinl.policies.card import PolicyCard, read_card
from vinl.policies.io import load_policy, save_policy


def clean(card: PolicyCard, name: str, start: str | None, commit: str | None) -> PolicyCard:
    """The card under its shipped name, with no measurements of another policy."""
    training: dict[str, Any] = dict(card.training)
    if "homes" in training:
        plans = [Path(plan).name for plan in training["homes"].get("plans", ())]
        training["homes"] = training["homes"] | {"plans": plans}
    lineage: list[dict[str, Any]] = list(training.get("lineage") or [])
    if lineage:
        *past, last = lineage
        shipped = shipped_trainings()
        past = [shipped.get(part.get("weights_sha256", ""), part) for part in past]
        training["lineage"] = [*past, last | {"training": f"vinl/{name}", "commit": commit or card.commit}]
        if past and training.get("origin"):
            training["origin"] = training["origin"] | {"commit": past[-1]["commit"]}
    if start is not None:
        training["from_policy"] = start
        if training.get("origin"):
            training["origin"] = training["origin"] | {"policy": start}
    return replace(card, name=name, training=training, commit=commit or card.commit, evaluation={})


def shipped_trainings() -> dict[str, dict[str, Any]]:
    """The last trainings of the shipped policies, by the digests of their weights."""
    cards = (read_card(path.parent) for path in sorted((assets_dir() / "policies").glob("*/card.json")))
    last = (card.training["lineage"][-1] for card in cards if card.training.get("lineage"))
    return {part["weights_sha256"]: part for part in last if "weights_sha256" in part}


def main() -> None:
    """Write the policy folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="folder of the run or policy")
    parser.add_argument("name", help="shipped name")
    parser.add_argument("--half", action="store_true", help="weights as float16")
    parser.add_argument("--from", dest="start", help="what the run started from, as the card is to say it")
    parser.add_argument("--commit", help="commit of the code that trained it, when the card does not know")
    options = parser.parse_args()
    policy = load_policy(options.run)
    card = clean(policy.card, options.name, options.start, options.commit)
    folder = assets_dir() / "policies" / options.name
    save_policy(folder, policy.network, card, options.half)
    for path in folder.iterdir():
        path.chmod(0o644)
    size = sum(path.stat().st_size for path in folder.iterdir()) / 1e6
    print(f"{folder}: {size:.1f} MB")


if __name__ == "__main__":
    main()
