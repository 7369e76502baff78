"""The Warp kernels of a depth camera's errors, one thread a camera or a pixel; the navigation environment and the
evaluation in MuJoCo C run the same ones. A file of their own: Warp compiles these functions, Python never runs them."""


# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

from typing import Any, no_type_check

import warp as wp

from vinl.sensing.kernels import look_through
from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})

PATCHES = wp.constant(8)
"""At most so many patches without a return in an image."""


@wp.struct
@no_type_check
class SensorRules:
    """Numbers of ``SensorConfig``."""

    noise: wp.float32
    scale: wp.float32
    pixels: wp.float32
    patches: wp.float32
    patch_size: wp.vec2
    edges: wp.float32
    edge_step: wp.float32
    surfaces: wp.float32
    surface_size: wp.float32
    range: wp.vec2
    delay: wp.vec2
    roll: wp.vec2
    pitch: wp.vec2
    height: wp.vec2
    amplitude: wp.vec2


@wp.struct
@no_type_check
class Cameras:
    """What is drawn for each camera at the start of an episode."""

    amplitude: wp.array(dtype=wp.float32)
    scale: wp.array(dtype=wp.float32)  # factor on all depths
    offset: wp.array(dtype=wp.vec3)  # roll, pitch [rad] and height [m]
    delay: wp.array(dtype=wp.float32)  # [s]
    surfaces: wp.array(dtype=wp.int32)  # which surfaces return nothing follows from this


@wp.kernel
@no_type_check
def draw_cameras(rules: SensorRules, key: wp.array(dtype=wp.int32), chosen: wp.array(dtype=wp.bool), cameras: Cameras):
    """Draw the chosen cameras anew, each from its key."""
    n = wp.tid()
    if not chosen[n]:
        return
    state = wp.rand_init(key[n], 0)
    low = rules.amplitude[0]
    cameras.amplitude[n] = low + (rules.amplitude[1] - low) * wp.randf(state)
    cameras.scale[n] = 1.0 + rules.scale * (2.0 * wp.randf(state) - 1.0)
    roll = rules.roll[0] + (rules.roll[1] - rules.roll[0]) * wp.randf(state)
    pitch = rules.pitch[0] + (rules.pitch[1] - rules.pitch[0]) * wp.randf(state)
    height = rules.height[0] + (rules.height[1] - rules.height[0]) * wp.randf(state)
    cameras.offset[n] = wp.vec3(roll, pitch, height)
    cameras.delay[n] = rules.delay[0] + (rules.delay[1] - rules.delay[0]) * wp.randf(state)
    cameras.surfaces[n] = wp.randi(state, 0, 2147483647)


@wp.kernel
@no_type_check
def draw_patches(
    rules: SensorRules,
    cameras: Cameras,
    rows: wp.array(dtype=wp.int32),
    key: wp.array(dtype=wp.int32),
    aspect: wp.float32,
    patches: wp.array(dtype=wp.vec3, ndim=2),
):
    """Where the patches without a return of an image are, in widths from its upper left corner, and the squares of
    their radii; negative: there is none."""
    image, k = wp.tid()
    a = rules.patch_size[0]
    b = rules.patch_size[1]
    area = 0.7853982 * (a * a + a * b + b * b) / 3.0  # of a circle, on average, in squares of the width
    chance = rules.patches * cameras.amplitude[rows[image]] * aspect / (area * float(PATCHES))
    state = wp.rand_init(key[image], -1 - k)
    there = wp.randf(state)
    x = wp.randf(state)
    y = wp.randf(state) * aspect
    radius = 0.5 * (a + (b - a) * wp.randf(state))
    patches[image, k] = wp.vec3(x, y, wp.where(there < chance, radius * radius, -1.0))


@wp.func
@no_type_check
def is_dead(rules: SensorRules, surfaces: wp.int32, p: wp.vec3, amplitude: wp.float32):
    """Whether the surface at a point of the world returns nothing: space is cut into cubes, some of which are dead."""
    i = wp.int32(wp.floor(p[0] / rules.surface_size))
    j = wp.int32(wp.floor(p[1] / rules.surface_size))
    k = wp.int32(wp.floor(p[2] / rules.surface_size))
    cell = (i * 73856093) ^ (j * 19349663) ^ (k * 83492791)
    state = wp.rand_init(surfaces, cell)
    return wp.randf(state) < rules.surfaces * amplitude


@wp.kernel
@no_type_check
def spoil_depth(
    rules: SensorRules,
    cameras: Cameras,
    rows: wp.array(dtype=wp.int32),
    key: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    rotation: wp.array(dtype=wp.mat33),
    tan_half: wp.vec2,
    far: wp.float32,
    unit: wp.float32,
    lost: wp.float32,
    patches: wp.array(dtype=wp.vec3, ndim=2),
    clean: wp.array(dtype=Any, ndim=3),
    spoilt: wp.array(dtype=Any, ndim=3),
):
    """Images as the camera gives them, from ideal ones.

    Image i is camera ``rows[i]``'s; ``unit`` metres are 1 in it, ``far`` [m] is where the ideal image ends, a pixel
    without a return reads ``lost``. The random numbers of an image follow from ``key[i]`` alone.
    """
    image, row, column = wp.tid()
    camera = rows[image]
    height = clean.shape[1]
    width = clean.shape[2]
    amplitude = cameras.amplitude[camera]
    z = wp.float32(clean[image, row, column]) * unit
    state = wp.rand_init(key[image], row * width + column)
    missed = wp.randf(state)
    beside = wp.randf(state)
    normal = wp.randn(state)
    gone = missed < rules.pixels * amplitude
    if rules.edges > 0.0 and beside < rules.edges * amplitude:
        left = wp.float32(clean[image, row, wp.max(column - 1, 0)]) * unit
        right = wp.float32(clean[image, row, wp.min(column + 1, width - 1)]) * unit
        gone = gone or wp.min(left, right) < z * (1.0 - wp.min(rules.edge_step, 0.99))
    if rules.patches > 0.0:
        at = wp.vec2((float(column) + 0.5) / float(width), (float(row) + 0.5) / float(width))
        for k in range(PATCHES):
            patch = patches[image, k]
            away = at - wp.vec2(patch[0], patch[1])
            gone = gone or wp.dot(away, away) < patch[2]
    if rules.surfaces > 0.0 and not gone and z < far:
        hit = position[image] + rotation[image] * look_through(row, column, height, width, tan_half) * z
        gone = is_dead(rules, cameras.surfaces[camera], hit, amplitude)
    if z < far:
        z = z * cameras.scale[camera] * (1.0 + rules.noise * amplitude * z * normal)
    gone = gone or z < rules.range[0] or z >= rules.range[1]
    value = wp.clamp(z, 0.0, far) / unit
    if gone:
        value = lost
    spoilt[image, row, column] = spoilt.dtype(value)


@wp.kernel
@no_type_check
def draw_uniform(key: wp.array(dtype=wp.int32), drawn: wp.array(dtype=wp.float32, ndim=2)):
    """Numbers in [0, 1) for each robot that follow from its key alone."""
    n, k = wp.tid()
    drawn[n, k] = wp.randf(wp.rand_init(key[n], 1 + k))
