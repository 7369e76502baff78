"""Measure a locomotion policy with the project's own commands and write the figures into its card.

    python scripts/measure_policy.py assets/policies/rough [--commit HASH] [--no-homes]

Takes minutes on two cores, longer for a policy that sees.
"""

from __future__ import annotations

import argparse
import json
import shlex
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from vinl.cli.app import main as vinl
from vinl.policies.card import read_card, write_card

BLOCKS = "eval-loco --terrain blocks --robots 64 --seconds 20 --seed 0"
LOCO = {
    "flat": "eval-loco --terrain flat --robots 64 --seconds 20 --seed 0",
    "flat_forward_only": "eval-loco --terrain flat --robots 64 --seconds 20 --seed 0 --commands forward",
    "rough": "eval-loco --terrain rough --robots 192 --seconds 20 --seed 0",
    "rough_forward_only": "eval-loco --terrain rough --robots 192 --seconds 20 --seed 0 --commands forward",
    "blocks": f"{BLOCKS} --density 1.0",
    "blocks_straight": f"{BLOCKS} --density 1.0 --commands straight",
    "blocks_navigator": f"{BLOCKS} --density 1.0 --commands navigator",
    "no_blocks": f"{BLOCKS} --density 0",
    "bars": "eval-loco --terrain bars --height 0.05 0.10 0.15 0.20 --crossings 32 --seed 0",
    "litter": "eval-loco --terrain litter --density 15 --robots 32 --seconds 20 --seed 0",
    "rooms": "eval-loco --terrain rooms --robots 72 --seconds 20 --seed 0 --density 1.0",
}
FORWARD = "_forward_only"
CHAIN = {
    "homes": "eval --nav oracle --episodes 10 --seeds 5 --obstacles none",
    "homes_paper_clutter": "eval --nav oracle --episodes 10 --seeds 5 --obstacles paper",
}
LOCO_FIGURES = (
    "falls",
    "linear_velocity_rmse",
    "yaw_rate_rmse",
    "foot_block_per_m",
    "foot_front_block_per_m",
    "foot_rear_block_per_m",
    "leg_block_per_m",
    "trunk_over_blocks",
    "mean_level",
    "clean_foot_crossings",
    "clean_crossings",
    "finished",
    "foot_steps_per_crossing",
    "leg_steps_per_crossing",
    "dirty_steps",
    "cost_of_transport",
    "leg_leg_per_m",
    "joint_overspeed",
)
CHAIN_FIGURES = ("success", "spl", "foot_collisions_per_m", "leg_contacts_per_m")


def run(command: str, policy: Path) -> dict:
    """One command's aggregate."""
    flag = "--policy" if command.startswith("eval-loco") else "--loco"
    with tempfile.TemporaryDirectory() as out:
        code = vinl([*shlex.split(command), flag, str(policy), "--out", out])
        if code:
            sys.exit(code)
        return json.loads((Path(out) / "results.json").read_text())["aggregate"]


def main() -> None:
    """Run every command and rewrite the card."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path, help="policy folder")
    parser.add_argument("--commit", help="commit of the code that trained it, when the card does not know")
    parser.add_argument("--no-homes", action="store_true", help="leave out the episodes in homes; the table has them")
    options = parser.parse_args()
    evaluation: dict[str, dict] = {}
    card = read_card(options.policy)
    ahead = card.training.get("commands", {}).get("left") == [0.0, 0.0]
    for name, command in (LOCO if options.no_homes else LOCO | CHAIN).items():
        row: dict = {"command": f"vinl {command}"}
        if ahead and name.endswith(FORWARD):
            # it was never told to go sideways, so that the two commands are one
            evaluation[name] = evaluation[name.removesuffix(FORWARD)] | row
            continue
        figures = run(command, options.policy)
        if name in LOCO:
            row |= {key: figures[key] for key in LOCO_FIGURES if figures.get(key) is not None}
        else:
            row |= {key: figures[key]["mean"] for key in CHAIN_FIGURES} | {"falls": figures["falls"]}
        evaluation[name] = row
    write_card(options.policy, replace(card, evaluation=evaluation, commit=options.commit or card.commit))
    print(json.dumps(evaluation, indent=2))


if __name__ == "__main__":
    main()
