"""Every training behind a policy: what it learned from in all, by samples, commit of the code and digest of the
weights."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from torch import Tensor

from vinl.policies.card import PolicyCard
from vinl.policies.identity import digest_tensors


def trace_lineage(card: PolicyCard, weights: Mapping[str, Tensor]) -> list[dict[str, Any]]:
    """The trainings behind a policy, the first one first, for the card of a training that starts from it.

    Args:
        weights: by name, as they were loaded.

    Returns:
        One row for each training: ``training`` (its name), ``samples``, ``commit`` and ``weights_sha256`` of its end;
        of a card that has no lineage, its own training alone.
    """
    known = card.training.get("lineage")
    if known:
        return [dict(row) for row in known]
    return [_own_row(card, digest_tensors(weights))]


def with_lineage(card: PolicyCard, weights: Mapping[str, Tensor]) -> PolicyCard:
    """The card of a policy that is written, with ``lineage`` and ``total_samples`` in its training.

    What ``training["origin"]`` brought under ``lineage`` comes before the card's own training. A card that has a
    lineage already is that of a policy which is written again: its last row gets the digest of these weights. The card
    of a policy that no training made stays as it is.
    """
    training = dict(card.training)
    origin = dict(training.get("origin") or {})
    past = origin.pop("lineage", [])
    digest = digest_tensors(weights)
    if "lineage" in training:
        rows = [dict(row) for row in training["lineage"]]
        rows[-1]["weights_sha256"] = digest
    elif card.samples > 0:
        rows = [*past, _own_row(card, digest)]
    else:
        return card
    if origin:
        training["origin"] = origin
    training |= {"lineage": rows, "total_samples": sum(row["samples"] for row in rows)}
    return replace(card, training=training)


def _own_row(card: PolicyCard, digest: str) -> dict[str, Any]:
    return {"training": card.name, "samples": card.samples, "commit": card.commit, "weights_sha256": digest}


def find_commit() -> str:
    """The git commit of this checkout, with ``+`` when it was changed; empty outside a checkout.

    The environment variable ``VINL_COMMIT`` names it where the code runs without its repository, as in a container.
    """
    if given := os.environ.get("VINL_COMMIT"):
        return given
    here = Path(__file__).resolve().parent
    try:
        commit = _git(here, "rev-parse", "--short", "HEAD")
        return commit + ("+" if _git(here, "status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.CalledProcessError):
        return ""


def _git(folder: Path, *command: str) -> str:
    done = subprocess.run(["git", "-C", str(folder), *command], capture_output=True, text=True, check=True)
    return done.stdout.strip()
