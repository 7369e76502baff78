"""Pictures for docs/floorplans.md: homes from the generator, and one of them as a mesh, read back.

python scripts/draw_home_pictures.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import trimesh

from vinl.world.drawing import save_contact_sheet
from vinl.world.homes import generate_home
from vinl.world.mesh import floorplan_mesh
from vinl.world.readers import load_floorplan

PICTURES = Path(__file__).resolve().parent.parent / "docs" / "images" / "floorplans"
SEEDS = range(100, 120)
MESH = 111


def main() -> None:
    print(save_contact_sheet([generate_home(seed) for seed in SEEDS], PICTURES / "homes.png", dpi=64))
    home = generate_home(MESH)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "mesh.ply"
        trimesh.Trimesh(*floorplan_mesh(home, ceiling=float(home.walls.rows[0, 6]))).export(file)
        print(save_contact_sheet([home, load_floorplan(file)], PICTURES / "read_mesh.png", dpi=90))


if __name__ == "__main__":
    main()
