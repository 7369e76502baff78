"""Floor plans from files: pictures, ROS maps, houses as JSON, meshes and the plans that travel with the package."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TypeVar

from vinl.config.errors import InputError
from vinl.config.loader import closest
from vinl.config.paths import assets_dir
from vinl.world.floorplan import FloorPlan
from vinl.world.readers.image import read_image_plan, read_ros_map
from vinl.world.readers.json_plan import expand_paths, read_json_plan

IMAGES = (".png", ".pgm")
ROS_MAPS = (".yaml", ".yml")
JSONS = (".json", ".jsonl", ".json.gz", ".jsonl.gz")
MESHES = (".glb", ".gltf", ".obj", ".ply", ".stl")

AnyPlan = TypeVar("AnyPlan", bound=str | Path | FloorPlan)

__all__ = ["check_file", "expand_paths", "load_floorplan", "load_floorplans", "open_floorplans", "shipped_floorplans"]


def shipped_floorplans() -> list[str]:
    """Names of the five evaluation plans that travel with the package."""
    return sorted(path.stem for path in (assets_dir() / "floorplans").glob("*.json"))


def load_floorplan(
    path: str | Path,
    resolution: float | None = None,
    min_speck: int = 0,
    wall_height: float = 2.5,
    up: str | None = None,
) -> FloorPlan:
    """Read a floor plan; the file's ending says how.

    Args:
        path: ``.png`` or ``.pgm`` picture; ``.yaml`` of a ROS map; ``.json``, ``.jsonl``, ``.jsonl.gz`` in the format
            of ProcTHOR, HouseExpo, Raster2Vec or this package, ``:index`` behind it choosing one of several; a
            triangle mesh ``.glb``, ``.obj``, ``.ply``, ``.stl``; or the bare name of a shipped plan.
        resolution: metres per pixel of a bare picture (0.05 if not given) or of Raster2Vec's vectors (their own if
            not given), metres per unit of a mesh or of HouseExpo (1 if not given); other kinds carry their own scale.
        min_speck: pieces of wall of fewer pixels than this are dropped from pictures and ROS maps; 0 keeps all.
        wall_height: height of walls in pictures, ROS maps, HouseExpo and vectors; what is higher in a mesh is left
            out [m].
        up: which way is up in a mesh: x, y, z, -x, -y or -z; if not given, y for ``.glb`` and ``.gltf``, else
            y or z, whichever the mesh is shorter along.

    Raises:
        InputError: if the file is missing, broken, or holds no floor that the robot can stand on.
    """
    text = str(path)
    if text in shipped_floorplans():
        text = str(assets_dir() / "floorplans" / f"{text}.json")
    finest = 0.002 if text.lower().endswith(IMAGES + ROS_MAPS) else 1e-4
    if resolution is not None and not finest <= resolution <= 2.0:
        raise InputError(f"--resolution {resolution:g}: give metres per pixel between {finest:g} and 2")
    if min_speck < 0:
        raise InputError(f"--min-speck {min_speck}: give a number of pixels, 0 or more")
    if not 0.3 <= wall_height <= 20.0:
        raise InputError(f"wall height {wall_height:g} m: give metres between 0.3 and 20")
    file, index = check_file(text)
    ending = file.name.lower()
    if ending.endswith(JSONS):
        return read_json_plan(file, index, resolution, wall_height)
    if index is not None:
        raise InputError(f"{text}: only JSON files hold several plans; leave :{index} away")
    if ending.endswith(ROS_MAPS):
        return read_ros_map(file, min_speck, wall_height)
    if ending.endswith(IMAGES):
        return read_image_plan(file, resolution, min_speck, wall_height)
    if ending.endswith(MESHES):
        from vinl.world.readers.mesh_plan import read_mesh_plan

        return read_mesh_plan(file, up, resolution, wall_height)
    raise InputError(f"{text}: unknown kind of floor plan; known are {', '.join(IMAGES + ROS_MAPS + JSONS + MESHES)}")


def check_file(path: str | Path) -> tuple[Path, int | None]:
    """The file of a floor plan, and the number of the plan in it. Raises ``InputError`` if there is no such file."""
    text, known = str(path), shipped_floorplans()
    if text in known:
        return assets_dir() / "floorplans" / f"{text}.json", None
    if not text.strip():
        raise InputError(f"the name of a floor plan is empty; give a file or a shipped plan: {', '.join(known)}")
    file, index = _split_index(text)
    if not _exists(file):
        raise InputError(
            f"{text}: no such file{closest(text, known)}; give a path or one of the shipped plans: {', '.join(known)}"
        )
    if file.is_dir():
        raise InputError(f"{text}: is a folder; give the files in it, for example {text}/map.yaml")
    return file, index


def load_floorplans(
    paths: Sequence[str | Path], resolution: float | None = None, min_speck: int = 0
) -> list[FloorPlan]:
    """Read several floor plans, the shipped ones if none are named; see ``load_floorplan``. One that is named twice,
    in the same way or another, is read once."""
    return [load_floorplan(path, resolution, min_speck) for path in _each_once(paths or shipped_floorplans())]


def open_floorplans(floorplans: str | Path | FloorPlan | Sequence[str | Path | FloorPlan]) -> list[FloorPlan]:
    """Floor plans from names, files and plans, or from one of them; all shipped ones from an empty list. What is given
    twice is there once. Raises ``InputError`` if a file is missing or broken, or it is no floor plan at all."""
    if isinstance(floorplans, (str, Path, FloorPlan)) or not isinstance(floorplans, Iterable):
        floorplans = [floorplans]
    chosen = list(floorplans)
    for plan in chosen:
        if not isinstance(plan, (str, Path, FloorPlan)):
            raise InputError(f"a floor plan is a name, a file or a FloorPlan, got {type(plan).__name__}")
    return [p if isinstance(p, FloorPlan) else load_floorplan(p) for p in _each_once(chosen or shipped_floorplans())]


def _each_once(plans: Sequence[AnyPlan]) -> list[AnyPlan]:
    """Floor plans without those that came before: the same object, or the same plan of the same file, whether a path or
    a shipped plan's name leads to it."""
    first: dict[object, AnyPlan] = {}
    for plan in plans:
        if isinstance(plan, FloorPlan):
            key: object = id(plan)
        else:
            file, index = check_file(plan)
            key = file.resolve(), index or 0
        first.setdefault(key, plan)
    return list(first.values())


def _exists(file: Path) -> bool:
    try:
        return file.exists()
    except OSError:  # a name that no file can have
        return False


def _split_index(text: str) -> tuple[Path, int | None]:
    """``houses.jsonl.gz:17`` -> the file and 17. A file that really is called so comes first."""
    head, colon, tail = text.rpartition(":")
    if not colon or _exists(Path(text)):
        return Path(text), None
    if head.lower().endswith(JSONS):
        try:
            return Path(head), int(tail)
        except ValueError:
            raise InputError(f"{text}: behind the colon stands the number of a plan, from 0 on") from None
    if tail.isdigit():
        return Path(head), int(tail)
    return Path(text), None
