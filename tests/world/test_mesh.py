import numpy as np
import pytest

from vinl.world.boxes import Blocks, Boxes
from vinl.world.floorplan import FloorPlan
from vinl.world.grid import GridFrame
from vinl.world.mesh import box_mesh, floor_mesh, floorplan_mesh, heightfield_mesh

trimesh = pytest.importorskip("trimesh")


def plan_of(walls: Boxes, frame: GridFrame) -> FloorPlan:
    floor = np.ones(frame.shape, bool)
    return FloorPlan("plan", "plan", walls, Boxes.empty(), floor, floor, frame)


def normals(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def test_boxes_are_closed_and_face_outward():
    rows = np.array([[1, 2, 0.3, 0.5, 0.2, 0.0, 0.7], [-1, 0, -2.0, 1.0, 0.1, 0.4, 2.5]])
    vertices, faces = box_mesh(Boxes(rows))
    assert vertices.shape == (16, 3) and faces.shape == (24, 3)
    assert vertices.dtype == np.float32 and faces.dtype == np.int32
    for k, row in enumerate(rows):
        mesh = trimesh.Trimesh(vertices[8 * k : 8 * k + 8], faces[12 * k : 12 * k + 12] - 8 * k, process=False)
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(row[3] * row[4] * (row[6] - row[5]), rel=1e-5)
        assert np.allclose(mesh.centroid, [row[0], row[1], (row[5] + row[6]) / 2], atol=1e-5)
        assert np.allclose(mesh.bounds[:, 2], row[5:7], atol=1e-6)


def test_corners_agree_with_the_boxes():
    boxes = Boxes(np.array([[1, 2, 0.3, 0.5, 0.2, 0.0, 0.7]]))
    vertices, _ = box_mesh(boxes)
    for corner in boxes.corners()[0]:
        assert np.abs(vertices[:, :2] - corner).sum(1).min() < 1e-6


def test_plan_mesh_has_floor_blocks_and_ceiling():
    frame = GridFrame(0.025, 0.025, 0.05, (40, 60))
    plan = plan_of(Boxes(np.array([[1, 1, 0, 1, 0.1, 0, 2.5]])), frame)
    blocks = Blocks(np.array([[2, 1, 0.4, 0.3, 0.2, 0.15]]))
    vertices, faces = floorplan_mesh(plan, blocks, ceiling=2.6)
    assert len(faces) == 12 + 12 + 2 + 2
    up = normals(vertices, faces)[:, 2]
    assert (up[24:26] > 0).all() and (up[26:] < 0).all()
    floor = vertices[faces[24:26].ravel()]
    assert np.allclose(floor.min(0), [0, 0, 0], atol=1e-6) and np.allclose(floor.max(0), [3, 2, 0], atol=1e-6)
    assert len(floorplan_mesh(plan)[1]) == 14


def test_empty_plan_is_only_floor():
    plan = plan_of(Boxes.empty(), GridFrame(0.0, 0.0, 0.1, (5, 5)))
    vertices, faces = floorplan_mesh(plan)
    assert (vertices == floor_mesh(plan.frame)[0]).all() and len(faces) == 2


def test_height_field_mesh():
    frame = GridFrame(-1.0, 2.0, 0.1, (5, 7))
    heights = np.random.default_rng(0).random(frame.shape).astype(np.float32)
    vertices, faces = heightfield_mesh(heights, frame)
    assert len(faces) == 2 * 4 * 6 and (normals(vertices, faces)[:, 2] > 0).all()
    assert np.allclose(vertices[2 * 7 + 3], [-0.7, 2.2, heights[2, 3]])
    with pytest.raises(ValueError, match="shape"):
        heightfield_mesh(heights.T, frame)
    with pytest.raises(ValueError, match="2 x 2"):
        heightfield_mesh(heights[:1], GridFrame(0.0, 0.0, 1.0, (1, 7)))
