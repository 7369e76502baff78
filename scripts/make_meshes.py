"""Draw the AlienGo's visual meshes, our own, and write them as STL into ``assets/aliengo/meshes``.

The dimensions are those of the real robot (trunk from x = -0.311 to 0.3386 m, y +-0.1045, z +-0.056; hip hub of
radius 0.0515; thigh and shank 0.25 m; foot radius 0.0265), the shapes are made here: rounded hulls, nothing of the
maker's. Run ``python scripts/make_meshes.py``; the same numbers give the same files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from vinl.config.paths import assets_dir

Mesh = trimesh.Trimesh


def rounded_box(lowest: tuple, highest: tuple, radius: float, steps: int = 3) -> Mesh:
    """A box with rounded edges: the hull of spheres in its corners."""
    low, high = np.array(lowest) + radius, np.array(highest) - radius
    ball = trimesh.creation.icosphere(subdivisions=steps - 1, radius=radius)
    corners = [np.where([i >> 2 & 1, i >> 1 & 1, i & 1], high, low) for i in range(8)]
    return trimesh.convex.convex_hull(np.concatenate([ball.vertices + corner for corner in corners]))


def join(parts: list[Mesh]) -> Mesh:
    """Several shapes as one mesh; where they overlap, both stay."""
    starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return Mesh(np.concatenate([part.vertices for part in parts]), np.concatenate(faces), process=False)


def hull(*parts: Mesh) -> Mesh:
    """The convex hull of several shapes."""
    return trimesh.convex.convex_hull(np.concatenate([part.vertices for part in parts]))


def ball(centre: tuple, radius: float, steps: int = 2) -> Mesh:
    """A sphere."""
    mesh = trimesh.creation.icosphere(subdivisions=steps, radius=radius)
    mesh.apply_translation(centre)
    return mesh


def disc(centre: tuple, axis: str, radius: float, length: float, bevel: float = 0.004, sides: int = 40) -> Mesh:
    """A drum with bevelled rims, its axis along x, y or z."""
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rings = [(radius - bevel, length / 2), (radius, length / 2 - bevel)]
    points = [[r * np.cos(a), r * np.sin(a), sign * z] for r, z in rings for sign in (1, -1) for a in angle]
    mesh = trimesh.convex.convex_hull(np.array(points))
    turn = {"x": ([0, 1, 0], np.pi / 2), "y": ([1, 0, 0], np.pi / 2), "z": ([0, 0, 1], 0.0)}[axis]
    mesh.apply_transform(trimesh.transformations.rotation_matrix(turn[1], turn[0]))
    mesh.apply_translation(centre)
    return mesh


def trunk() -> Mesh:
    """The bright part of the trunk: shell with chamfered edges, head, tail and battery lid."""
    shell = hull(
        rounded_box((-0.20, -0.075, -0.050), (0.20, 0.075, 0.040), 0.016),
        rounded_box((-0.185, -0.060, -0.052), (0.185, 0.060, 0.054), 0.012),
    )
    neck = hull(
        rounded_box((0.16, -0.068, -0.046), (0.24, 0.068, 0.046), 0.014),
        rounded_box((0.23, -0.062, -0.040), (0.318, 0.062, 0.040), 0.018),
    )
    face = hull(
        rounded_box((0.29, -0.058, -0.030), (0.3330, 0.058, 0.034), 0.012),
        rounded_box((0.29, -0.045, -0.024), (0.3360, 0.045, 0.028), 0.008),
    )
    tail = hull(
        rounded_box((-0.24, -0.068, -0.046), (-0.16, 0.068, 0.046), 0.014),
        rounded_box((-0.311, -0.055, -0.036), (-0.24, 0.055, 0.036), 0.016),
    )
    lid = rounded_box((-0.13, -0.045, 0.040), (0.12, 0.045, 0.056), 0.007, 2)
    return join([shell, neck, face, tail, lid])


def trunk_dark() -> Mesh:
    """The dark part of the trunk: camera window, motors of the hips, belly, side rails, rear vents, handle."""
    window = rounded_box((0.32, -0.046, -0.008), (0.3386, 0.046, 0.018), 0.0045, 2)
    eyes = [disc((0.3365, y, 0.005), "x", r, 0.004, 0.0008, 24) for y, r in ((-0.025, 0.008), (0.025, 0.008))]
    vents = [rounded_box((-0.3108, -0.035, z - 0.004), (-0.30, 0.035, z + 0.004), 0.003, 2) for z in (-0.015, 0, 0.015)]
    seams = [rounded_box((x - 0.003, -0.070, 0.030), (x + 0.003, 0.070, 0.0515), 0.002, 1) for x in (-0.155, 0.155)]
    belly = rounded_box((-0.15, -0.050, -0.056), (0.15, 0.050, -0.040), 0.006, 2)
    rails = [
        rounded_box((-0.145, s * 0.078 - 0.009, -0.012), (0.145, s * 0.078 + 0.009, 0.012), 0.006, 2) for s in (1, -1)
    ]
    lugs = [
        rounded_box((x - 0.016, s * 0.088 - 0.0165, -0.020), (x + 0.016, s * 0.088 + 0.0165, 0.020), 0.006, 2)
        for x in (0.164, -0.164)
        for s in (1, -1)
    ]
    motors = [disc((x * 0.185, y * 0.051, 0), "x", 0.0505, 0.070) for x in (1, -1) for y in (1, -1)]
    return join([window, *eyes, *vents, *seams, belly, *rails, *lugs, *motors])


def hip() -> Mesh:
    """Left hip: abduction hub about x, and the thigh's motor about y, 0.0868 m outboard less half the thigh."""
    hub = disc((0, 0, 0), "x", 0.0515, 0.062, 0.008)
    caps = [disc((s * 0.033, 0, 0), "x", 0.030, 0.012, 0.003, 32) for s in (1, -1)]
    arm = hull(disc((0, 0.006, 0), "y", 0.040, 0.03), disc((0, 0.036, 0), "y", 0.0445, 0.02))
    motor = disc((0, 0.0475, 0), "y", 0.0475, 0.030, 0.005)
    return join([hub, *caps, arm, motor])


def thigh() -> Mesh:
    """Hub about y at the top, tapering shaft that runs behind the axis, knee."""
    hub = disc((0, 0, 0), "y", 0.046, 0.044, 0.007)
    cap = [disc((0, s * 0.023, 0), "y", 0.029, 0.008, 0.002, 32) for s in (1, -1)]
    upper = hull(disc((-0.004, 0, -0.01), "y", 0.040, 0.034, 0.008), ball((-0.017, 0.0, -0.11), 0.0215))
    lower = hull(
        rounded_box((-0.040, -0.019, -0.125), (0.003, 0.019, -0.095), 0.011),
        rounded_box((-0.034, -0.0165, -0.222), (-0.002, 0.0165, -0.20), 0.010),
    )
    shin_guard = hull(ball((-0.018, 0, -0.205), 0.019), disc((0, 0, -0.25), "y", 0.021, 0.040, 0.005))
    knee = disc((0, 0, -0.25), "y", 0.0255, 0.046, 0.005)
    return join([hub, *cap, upper, lower, shin_guard, knee])


def calf() -> Mesh:
    """Slim shank that bends a little forward, then down to the foot."""
    top = hull(disc((0, 0, 0), "y", 0.019, 0.030, 0.004), ball((0.003, 0, -0.05), 0.0155))
    shaft = hull(ball((0.003, 0, -0.05), 0.0155), ball((0.0115, 0, -0.19), 0.0125))
    ankle = hull(ball((0.0115, 0, -0.19), 0.0125), ball((0.001, 0, -0.236), 0.0145))
    collar = hull(ball((0.004, 0, -0.225), 0.0165), ball((0.0005, 0, -0.238), 0.0185))
    return join([top, shaft, ankle, collar])


def foot() -> Mesh:
    """The rubber ball."""
    return ball((0, 0, 0), 0.0265, 3)


def main() -> None:
    """Write every mesh and say how large it is."""
    folder = Path(assets_dir()) / "aliengo" / "meshes"
    folder.mkdir(parents=True, exist_ok=True)
    for make in (trunk, trunk_dark, hip, thigh, calf, foot):
        mesh = make()
        path = folder / f"{make.__name__}.stl"
        mesh.export(path)
        low, high = np.round(mesh.bounds, 4)
        print(f"{path.name}: {len(mesh.faces)} faces, {path.stat().st_size / 1000:.0f} kB, {low} to {high} m")


if __name__ == "__main__":
    main()
