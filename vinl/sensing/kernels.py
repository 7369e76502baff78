"""The Warp kernels of the depth camera. A file of their own: Warp compiles these functions, Python never runs them."""

# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

from typing import Any, no_type_check

import warp as wp

from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})  # nobody differentiates a picture; compiles in half the time


@wp.func
@no_type_check
def look_through(row: wp.int32, column: wp.int32, height: wp.int32, width: wp.int32, tan_half: wp.vec2) -> wp.vec3:
    """The way through the middle of a pixel in the camera's frame, of unit length along the optical axis, so that a
    ray's parameter is planar depth."""
    left = tan_half[0] * (1.0 - (2.0 * wp.float32(column) + 1.0) / wp.float32(width))
    up = tan_half[1] * (1.0 - (2.0 * wp.float32(row) + 1.0) / wp.float32(height))
    return wp.vec3(1.0, left, up)


@wp.kernel
@no_type_check
def render_depth(
    meshes: wp.array(dtype=wp.uint64),
    world: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    rotation: wp.array(dtype=wp.mat33),
    tan_half: wp.vec2,
    far: wp.float32,
    floor: wp.float32,
    depth: wp.array(dtype=Any, ndim=3),
):
    """One thread a pixel. The level floor is not in the meshes: where it is hit follows from one division, and nothing
    behind it is looked for; minus infinity: there is none."""
    image, row, column = wp.tid()
    direction = rotation[image] * look_through(row, column, depth.shape[1], depth.shape[2], tan_half)
    start = position[image]
    t = far
    if direction[2] < 0.0 and start[2] > floor:
        t = wp.min(far, (floor - start[2]) / direction[2])
    hit = wp.mesh_query_ray(meshes[world[image]], start, direction, t)
    if hit.result:
        t = hit.t
    depth[image, row, column] = depth.dtype(t)


@wp.kernel
@no_type_check
def cast_rays(
    meshes: wp.array(dtype=wp.uint64),
    world: wp.array(dtype=wp.int32),
    origin: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    far: wp.float32,
    distance: wp.array(dtype=wp.float32),
):
    """The bare kernel that the camera is measured against: given rays, nothing computed around the query."""
    ray = wp.tid()
    t = far
    hit = wp.mesh_query_ray(meshes[world[ray]], origin[ray], direction[ray], far)
    if hit.result:
        t = hit.t
    distance[ray] = t
