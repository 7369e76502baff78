"""Sound small files of every kind that vinl reads, and what reads them."""

from __future__ import annotations

import gzip
import io
import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from random import Random
from typing import Any

import mutate
import numpy as np
from PIL import Image

from vinl.config.paths import configs_dir

SQUARE = ((0, 0), (4, 0), (4, 3), (0, 3))
"""Corners of a room [m]."""


@dataclass(frozen=True)
class Reader:
    """One kind of file.

    Attributes:
        name: of the kind.
        seeds: sound files by name; the name's ending is kept for their mutants.
        mutate: damages the content of one.
        read: reads one, or raises ``InputError``.
        beside: files that lie in the same folder.
    """

    name: str
    seeds: dict[str, bytes]
    mutate: Callable[[bytes, Random], bytes]
    read: Callable[[Path], object]
    beside: dict[str, bytes]

    def mutant(self, number: int, seed: int = 0) -> tuple[str, bytes]:
        """Name and content of a damaged file, the same for the same numbers."""
        rng = Random(f"{seed}/{self.name}/{number}")
        name = sorted(self.seeds)[number % len(self.seeds)]
        return name, self.mutate(self.seeds[name], rng)

    def place(self, folder: Path, name: str, content: bytes) -> Path:
        """The file in a folder, with what has to lie beside it."""
        for other, data in {**self.beside, name: content}.items():
            (folder / other).parent.mkdir(parents=True, exist_ok=True)
            (folder / other).write_bytes(data)
        return folder / name


def make_readers(results: Path) -> dict[str, Reader]:
    """All kinds of files by name.

    Args:
        results: a folder of ``vinl eval``, whose files are damaged.
    """
    return {reader.name: reader for reader in (*_plans(), *_policies(), *_configs(), *_results(results))}


def _plans() -> Iterator[Reader]:
    from vinl.world.readers import load_floorplan

    yield Reader("png", _pngs(), mutate.mutate_png, load_floorplan, {})
    yield Reader("pgm", _pgms(), mutate.mutate_pgm, load_floorplan, {})
    ros = b"image: map.pgm\nresolution: 0.05\norigin: [-1.0, -2.0, 0.1]\nnegate: 0\noccupied_thresh: 0.65\n"
    ros += b"free_thresh: 0.196\nmode: trinary\n"
    yield Reader("ros map", {"map.yaml": ros}, mutate.mutate_yaml, load_floorplan, {"map.pgm": _pgms()["p5.pgm"]})
    yield Reader("procthor", _houses(), _mutate_packed, load_floorplan, {"asset_bbox.json": _SIZES})
    outline = [[0, 0], [6, 0], [6, 4], [3.1, 4], [3.1, 1.2], [3.0, 1.2], [3.0, 4], [0, 4]]
    expo = {"id": "home", "verts": outline, "bbox": {"min": [0, 0], "max": [6, 4]}}
    expo["room_category"] = {"Kitchen": [[0, 0, 3, 4]], "Bedroom": [[3.1, 0, 6, 4]]}
    yield Reader("houseexpo", {"expo.json": _json(expo)}, mutate.mutate_json, load_floorplan, {})
    yield Reader("raster2vec", {"vectors.json": _json(_vectors())}, mutate.mutate_json, load_floorplan, {})
    yield Reader("mesh", _meshes(), mutate.mutate_mesh, load_floorplan, {})
    yield Reader("own json", _own(), mutate.mutate_json, load_floorplan, {})


def _policies() -> Iterator[Reader]:
    from vinl.gait.config import GaitConfig
    from vinl.policies.card import CARD_FILE, locomotion_card
    from vinl.policies.io import WEIGHTS_FILE, load_policy, save_policy
    from vinl.policies.networks import StepActor

    network = StepActor(actor=(8,))
    folder = save_policy(
        "fuzz-policy", network, locomotion_card("small", network.describe(), gait=asdict(GaitConfig()))
    )
    weights, card = ((folder / name).read_bytes() for name in (WEIGHTS_FILE, CARD_FILE))
    yield Reader(
        "card", {CARD_FILE: card}, mutate.mutate_json, lambda p: load_policy(p.parent), {WEIGHTS_FILE: weights}
    )


def _configs() -> Iterator[Reader]:
    from vinl.chain.config import EvaluationConfig
    from vinl.config.loader import load_config
    from vinl.loco.config import LocoConfig
    from vinl.nav.config import NavConfig
    from vinl.world.homes import HomeConfig

    kinds: dict[str, Any] = {"eval.yaml": EvaluationConfig, "loco.yaml": LocoConfig, "nav.yaml": NavConfig}
    shipped = {"eval.yaml": "eval/default", "loco.yaml": "loco/teacher", "nav.yaml": "nav/default"}
    seeds = {name: (configs_dir() / f"{source}.yaml").read_bytes() for name, source in shipped.items()}
    beside = {file.name: file.read_bytes() for file in configs_dir().glob("loco/*.yaml")}
    kinds["homes.yaml"], seeds["homes.yaml"] = HomeConfig, b"area: [60, 90]\nfurniture_density: [0, 0.1]\n"
    yield Reader("config", seeds, mutate.mutate_yaml, lambda path: load_config(kinds[path.name], path), beside)


def _results(folder: Path) -> Iterator[Reader]:
    from vinl.benchmark.folders import read_folders

    files = {str(f.relative_to(folder)): f.read_bytes() for f in sorted(folder.rglob("*.json*")) if f.is_file()}
    read = {name: data for name, data in files.items() if name in ("run.json", "episodes.jsonl")}

    def damage(data: bytes, rng: Random) -> bytes:
        return mutate.mutate_lines(data, rng) if data == read["episodes.jsonl"] else mutate.mutate_json(data, rng)

    yield Reader("results", read, damage, lambda path: read_folders([path.parent], path.parent / "out"), files)


def _json(tree: Any) -> bytes:
    return json.dumps(tree).encode()


def _walls() -> np.ndarray:
    """A small home of two rooms, dark on light."""
    picture = np.full((70, 90), 254, np.uint8)
    for rows, columns in ((slice(5, 8), slice(5, 85)), (slice(62, 65), slice(5, 85)), (slice(5, 65), slice(5, 8))):
        picture[rows, columns] = 0
    picture[5:65, 82:85] = picture[5:40, 44:46] = 0
    return picture


def _pngs() -> dict[str, bytes]:
    grey = Image.fromarray(_walls())
    opaque = Image.new("RGBA", grey.size, (0, 0, 0, 0))
    opaque.paste((20, 20, 20, 255), mask=grey.point(lambda v: 255 - v))
    kinds = {
        "grey": grey,
        "colour": grey.convert("RGB"),
        "opaque": opaque,
        "palette": grey.convert("P"),
        "bits": grey.convert("1"),
        "deep": Image.fromarray(_walls().astype(np.uint16) * 257),
    }
    return {f"{name}.png": _save(image, "PNG") for name, image in kinds.items()}


def _pgms() -> dict[str, bytes]:
    pixels = _walls()
    rows = "\n".join(" ".join(map(str, row)) for row in pixels.tolist())
    return {"p5.pgm": _save(Image.fromarray(pixels), "PPM"), "p2.pgm": f"P2\n90 70\n255\n{rows}\n".encode()}


def _save(image: Image.Image, kind: str) -> bytes:
    file = io.BytesIO()
    image.save(file, kind)
    return file.getvalue()


_SIZES = _json({"Bed_1": {"bbox": [1.0, 0.6, 1.6]}})


def _houses() -> dict[str, bytes]:
    def at(x: float, z: float, y: float = 0.0) -> dict[str, float]:
        return {"x": x, "y": y, "z": z}

    def wall(name: str, a: tuple[float, float], b: tuple[float, float]) -> dict[str, Any]:
        return {"id": name, "polygon": [at(*a), at(*b), at(*a, 2.8), at(*b, 2.8)]}

    walls = [wall(f"wall|2|{k}", SQUARE[k], SQUARE[(k + 1) % 4]) for k in range(4)]
    walls += [wall(f"wall|3|{k}", (a[0] + 4, a[1]), (b[0] + 4, b[1])) for k, a, b in _sides()]
    hole = [at(1.0, 0.0), at(2.0, 0.0, 2.1)]
    door = {"id": "d", "room0": "2", "room1": "3", "wall0": "wall|2|1", "wall1": "wall|3|3", "holePolygon": hole}
    rooms = [
        {"roomType": "Kitchen", "floorPolygon": [at(x, z) for x, z in SQUARE]},
        {"roomType": "Bedroom", "floorPolygon": [at(x + 4, z) for x, z in SQUARE]},
    ]
    bed = {"assetId": "Bed_1", "position": at(7.0, 2.0, 0.3), "rotation": at(0, 0, 90)}
    house = {"rooms": rooms, "walls": walls, "doors": [door], "objects": [bed]}
    packed = gzip.compress(_json(house) + b"\n" + _json(house) + b"\n", mtime=0)
    return {"house.json": _json(house), "houses.jsonl.gz": packed}


def _sides() -> Iterator[tuple[int, tuple[float, float], tuple[float, float]]]:
    yield from ((k, SQUARE[k], SQUARE[(k + 1) % 4]) for k in range(4))


def _mutate_packed(data: bytes, rng: Random) -> bytes:
    """Inside the gzip file, or the gzip file itself."""
    if not data.startswith(b"\x1f\x8b"):
        return mutate.mutate_json(data, rng)
    if rng.random() < 0.5:
        return mutate.mutate_bytes(data, rng)
    return gzip.compress(mutate.mutate_lines(gzip.decompress(data), rng), mtime=0)


def _vectors() -> dict[str, Any]:
    walls = [[0, 0, 400, 0], [400, 0, 800, 0], [800, 0, 800, 300], [0, 300, 800, 300], [0, 0, 0, 300]]
    walls.append([400, 0, 400, 300])
    icons = [[20, 20, 80, 80, "toilet"], [500, 100, 700, 200, "entrance"]]
    rooms = [[100, 140, 140, 160, "bedroom"], [0, 0, 5, 5, "point"]]
    doors = [[400, 50, 400, 150], [100, 300, 200, 300]]
    return {"walls": walls, "doors": doors, "icons": icons, "rooms": rooms, "m_per_px_est": 0.01}


def _own() -> dict[str, bytes]:
    sides = [{"from": a, "to": b, "thickness": 0.1} for _, a, b in _sides()]
    plan = {
        "schema": "vinl/floorplan/1",
        "name": "room",
        "height": 2.6,
        "rooms": [{"name": "Room", "outline": SQUARE}],
        "walls": sides,
        "doors": [{"from": [1, 0], "to": [2, 0], "height": 2.0}],
        "windows": [{"from": [0, 1], "to": [0, 2], "span": [1.0, 2.0]}],
        "furniture": [{"at": [3, 2], "size": [0.6, 0.4], "turn": 30, "span": [0.0, 0.7]}],
    }
    boxes = {
        "schema": "vinl/floorplan-boxes/1",
        "name": "boxes",
        "grid": {"x0": 0.0, "y0": 0.0, "resolution": 0.05, "rows": 80, "columns": 80},
        "inside": [[0.0, 0.0, 4.0, 3.0]],
        "walls": [[2.0, 0.0, 0.0, 4.0, 0.1, 0.0, 2.5], [2.0, 3.0, 0.3, 4.0, 0.1, 0.0, 2.5]],
        "furniture": [[3.0, 2.0, 0.0, 0.5, 0.5, 0.0, 0.7]],
        "windows": [],
        "labels": [{"name": "Room", "at": [2.0, 1.5]}],
    }
    return {"plan.json": _json(plan), "boxes.json": _json(boxes)}


def _meshes() -> dict[str, bytes]:
    import trimesh

    from vinl.world.mesh import floorplan_mesh
    from vinl.world.readers import load_floorplan

    found, folder = {}, Path("fuzz-mesh")
    folder.mkdir(exist_ok=True)
    (folder / "plan.json").write_bytes(_own()["boxes.json"])
    vertices, faces = floorplan_mesh(load_floorplan(folder / "plan.json"))
    shutil.rmtree(folder)
    for ending in ("obj", "ply", "stl", "glb"):
        turned = np.column_stack([vertices[:, 0], vertices[:, 2], -vertices[:, 1]]) if ending == "glb" else vertices
        data = trimesh.Trimesh(turned, faces, process=False).export(file_type=ending)
        found[f"home.{ending}"] = data.encode() if isinstance(data, str) else data
    return found
