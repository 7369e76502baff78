"""The Warp kernels of what robots see: one thread a camera, or a pixel. A file of their own: Warp compiles these
functions, Python never runs them."""

# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

from typing import no_type_check

import warp as wp

from vinl.nav.grids import Homes
from vinl.nav.motion_kernels import place_after
from vinl.nav.structs import Robots, Rules
from vinl.sensing.kernels import look_through
from vinl.sensing.sensor_kernels import Cameras
from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})


@wp.kernel
@no_type_check
def draw_keys(seed: wp.array(dtype=wp.int32), salt: wp.int32, key: wp.array(dtype=wp.int32)):
    """A number for each robot and step that other random numbers follow from."""
    n = wp.tid()
    key[n] = wp.int32(wp.rand_init(seed[0] + 4 * seed[1] + salt, n) & wp.uint32(2147483647))


@wp.kernel
@no_type_check
def aim_cameras(
    rules: Rules,
    seed: wp.array(dtype=wp.int32),
    robots: Robots,
    cameras: Cameras,
    position: wp.array(dtype=wp.vec3),
    rotation: wp.array(dtype=wp.mat33),
):
    """Where each camera was and where it looked when it took the image of this step."""
    n = wp.tid()
    state = wp.rand_init(seed[0] + 4 * seed[1] + 2, n)
    mount = robots.mount[n]
    sway = robots.amplitude[n] * robots.sway[n]
    roll = mount[0] + rules.tilt_shake[0] * sway[0] + rules.tilt_uniform * (2.0 * wp.randf(state) - 1.0)
    pitch = mount[1] + rules.tilt_shake[1] * sway[1] + rules.tilt_uniform * (2.0 * wp.randf(state) - 1.0)
    height = rules.mount_height + mount[2] + rules.height_shake * sway[2]
    yaw = robots.yaw[n]
    p = robots.position[n]
    delay = cameras.delay[n]
    if delay > 0.0:  # back along the arc that the robot came on
        twist = robots.twist[n]
        p = place_after(p, yaw, -twist[0], -twist[1], -twist[2], wp.vec2(0.0, 0.0), delay)
        yaw = yaw - delay * twist[2]
    cy = wp.cos(yaw)
    sy = wp.sin(yaw)
    cp = wp.cos(pitch)
    sp = wp.sin(pitch)
    cr = wp.cos(roll)
    sr = wp.sin(roll)
    turn = wp.mat33(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0)
    tilt = wp.mat33(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp) * wp.mat33(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr)
    cd = wp.cos(rules.pitch_down)
    sd = wp.sin(rules.pitch_down)
    rest = wp.mat33(cd, 0.0, sd, 0.0, 1.0, 0.0, -sd, 0.0, cd)
    off = cameras.offset[n]
    if off[0] != 0.0 or off[1] != 0.0 or off[2] != 0.0:  # as it was mounted
        co = wp.cos(off[0])
        so = wp.sin(off[0])
        ce = wp.cos(off[1])
        se = wp.sin(off[1])
        rest = rest * wp.mat33(ce, 0.0, se, 0.0, 1.0, 0.0, -se, 0.0, ce)
        rest = rest * wp.mat33(1.0, 0.0, 0.0, 0.0, co, -so, 0.0, so, co)
        height = height + off[2]
    ahead = wp.vec3(rules.forward, 0.0, 0.0)
    if rules.with_trunk != 0:
        rotation[n] = turn * tilt * rest
        ahead = turn * tilt * ahead
    else:
        # the camera turns about itself: roll about its own axis, pitch about its own side
        rotation[n] = turn * rest * tilt
        ahead = turn * ahead
    position[n] = wp.vec3(p[0] + ahead[0], p[1] + ahead[1], wp.max(height + ahead[2], 0.05))


@wp.kernel
@no_type_check
def render_interior(
    homes: Homes,
    rules: Rules,
    robots: Robots,
    position: wp.array(dtype=wp.vec3),
    rotation: wp.array(dtype=wp.mat33),
    depth: wp.array(dtype=wp.float16, ndim=3),
):
    """Depth along the optical axis as a fraction of the far limit, one thread a pixel. Floor and ceiling are planes: no
    rays are lost on them, and none leaves a home through its floor."""
    n, row, column = wp.tid()
    direction = rotation[n] * look_through(row, column, depth.shape[1], depth.shape[2], rules.tan_half)
    origin = position[n]
    far = rules.far
    if direction[2] < -1.0e-6:
        far = wp.min(far, -origin[2] / direction[2])
    ceiling = robots.mount[n][3]
    if direction[2] > 1.0e-6 and ceiling > 0.0:
        far = wp.min(far, wp.max(ceiling - origin[2], 0.0) / direction[2])
    hit = wp.mesh_query_ray(homes.meshes[robots.home[n]], origin, direction, far)
    if hit.result:
        far = wp.min(hit.t, far)
    depth[n, row, column] = wp.float16(far / rules.far)
