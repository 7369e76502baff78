"""Measure a locomotion policy with the project's own commands and write the figures into its card.

    python scripts/measure_policy.py assets/policies/rough [--commit HASH] [--table runs/table/results.json]

Takes minutes on two cores, longer for a policy that sees. With a walked table, figures in homes come from its rows.
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
BARS = "eval-loco --terrain bars --height 0.05 0.10 0.15 0.20 --crossings 128"
LOCO = {
    "flat": "eval-loco --terrain flat --robots 64 --seconds 20 --seed 0",
    "flat_forward_only": "eval-loco --terrain flat --robots 64 --seconds 20 --seed 0 --commands forward",
    "rough": "eval-loco --terrain rough --robots 192 --seconds 20 --seed 0",
    "rough_forward_only": "eval-loco --terrain rough --robots 192 --seconds 20 --seed 0 --commands forward",
    "blocks": f"{BLOCKS} --density 1.0",
    "blocks_straight": f"{BLOCKS} --density 1.0 --commands straight",
    "blocks_navigator": f"{BLOCKS} --density 1.0 --commands navigator",
    "no_blocks": f"{BLOCKS} --density 0",
    "bars": f"{BARS} --seed 4003",
    "bars_slow": f"{BARS} --speed 0.3 --seed 4004",
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
CHAIN_FIGURES = ("success", "spl", "foot_collisions_per_m", "paper_foot_collisions_per_m", "leg_contacts_per_m")
ROWS = {
    "homes": {"obstacles": "none", "navigation": "oracle"},
    "homes_paper_clutter": {"obstacles": "paper", "navigation": "oracle"},
    "chain_no_clutter": {"obstacles": "none", "navigation": "nav"},
    "chain_paper_clutter": {"obstacles": "paper", "navigation": "nav"},
}
"""What a row of the table walks, by the group of the card that it gives."""


def choose(figures: dict) -> dict:
    """What a card keeps of one command's aggregate."""
    return {key: figures[key] for key in LOCO_FIGURES if figures.get(key) is not None}


def run(command: str, policy: Path) -> dict:
    """One command's aggregate."""
    flag = "--policy" if command.startswith("eval-loco") else "--loco"
    with tempfile.TemporaryDirectory() as out:
        code = vinl([*shlex.split(command), flag, str(policy), "--out", out])
        if code:
            sys.exit(code)
        return json.loads((Path(out) / "results.json").read_text())["aggregate"]


def take_rows(table: Path, name: str) -> dict[str, dict]:
    """Groups of a card from the rows of a table without recovery: a locomotion policy's with its own legs, a navigation
    policy's with ``loco``."""
    data, groups = json.loads(table.read_text()), {}
    for row, walked in data["rows"].items():
        legs, guide = (walked["policies"][part]["name"] for part in ("locomotion", "navigation"))
        if name not in (legs, guide) or (name == guide and legs != "loco") or row.endswith("recovery"):
            continue
        for group, asked in ROWS.items():
            if asked == {"obstacles": walked["obstacles"], "navigation": guide}:
                figures = {key: walked["aggregate"][key]["mean"] for key in CHAIN_FIGURES}
                command = f"{' '.join(data['command'])}, row {row}"
                groups[group] = {"command": command} | figures | {"falls": walked["aggregate"]["falls"]}
    return groups


def main() -> None:
    """Run every command and rewrite the card."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("policy", type=Path, help="policy folder")
    parser.add_argument("--commit", help="commit of the code that trained it, when the card does not know")
    parser.add_argument("--table", type=Path, help="results.json of a walked table: figures in homes are its rows'")
    options = parser.parse_args()
    card = read_card(options.policy)
    evaluation = card.evaluation | ({} if options.table is None else take_rows(options.table, card.name))
    commands = (LOCO if options.table else LOCO | CHAIN) if card.kind == "locomotion" else {}
    ahead = card.training.get("commands", {}).get("left") == [0.0, 0.0]
    for name, command in commands.items():
        row: dict = {"command": f"vinl {command}"}
        if ahead and name.endswith(FORWARD):
            # it was never told to go sideways, so that the two commands are one
            evaluation[name] = evaluation[name.removesuffix(FORWARD)] | row
            continue
        figures = run(command, options.policy)
        if name in LOCO:
            row |= choose(figures)
            by_height = figures.get("by_height", {}) if name.startswith("bars") else {}
            row |= {f"{height} m": choose(one) for height, one in by_height.items()}
        else:
            row |= {key: figures[key]["mean"] for key in CHAIN_FIGURES} | {"falls": figures["falls"]}
        evaluation[name] = row
    write_card(options.policy, replace(card, evaluation=evaluation, commit=options.commit or card.commit))
    print(json.dumps(evaluation, indent=2))


if __name__ == "__main__":
    main()
