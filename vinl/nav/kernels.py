"""The Warp kernels of the navigation environment: the state of all robots, how they move and begin their episodes (one
thread a robot), and what they see (one thread a pixel). A file of its own: Warp compiles these functions, Python never
runs them."""

# ruff: noqa: UP018, RUF046 - a variable of a kernel that changes must be made by its type
# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

from typing import Any, no_type_check

import warp as wp

from vinl.nav.config import NavConfig
from vinl.nav.home_grids import FIELD, NOWHERE, Homes, read_distance, touches
from vinl.sensing.kernels import look_through
from vinl.sensing.sensor_kernels import Cameras
from vinl.sensing.torch_warp import fill_struct
from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})


@wp.struct
@no_type_check
class Robots:
    """The state of all robots."""

    home: wp.array(dtype=wp.int32)
    goal: wp.array(dtype=wp.int32)
    position: wp.array(dtype=wp.vec2)
    yaw: wp.array(dtype=wp.float32)
    speed: wp.array(dtype=wp.float32)
    yaw_rate: wp.array(dtype=wp.float32)
    twist: wp.array(dtype=wp.vec3)  # forward, sideways [m/s] and yaw rate [rad/s] of the last step as it was made
    distance: wp.array(dtype=wp.float32)
    gain: wp.array(dtype=wp.vec4)  # of forward speed and yaw rate, yaw drift [rad/s], and factor on the noises
    mount: wp.array(dtype=wp.vec4)  # roll, pitch, height of this episode's camera, height of the ceiling (0: none)
    amplitude: wp.array(dtype=wp.float32)  # of this episode's sway
    sway: wp.array(dtype=wp.vec3)  # roll, pitch and height within the episode, each of variance 1
    previous: wp.array(dtype=wp.vec2)  # what the robot knows of its last step
    give_way: wp.array(dtype=wp.float32)  # of this episode


@wp.struct
@no_type_check
class Rules:
    """Numbers of the configuration."""

    length: wp.float32
    width: wp.float32
    min_speed: wp.float32
    max_speed: wp.float32
    max_yaw_rate: wp.float32
    period: wp.float32
    success_radius: wp.float32
    least: wp.float32  # distance at the start
    most: wp.float32
    start_speed: wp.vec2
    speed_lag: wp.float32
    yaw_lag: wp.float32
    speed_gain: wp.vec2
    yaw_gain: wp.vec2
    speed_noise: wp.float32
    yaw_noise: wp.float32
    side_slip: wp.float32
    stopped_noise: wp.float32
    yaw_drift: wp.float32
    execution_amplitude: wp.vec2
    give_way: wp.float32
    held_share: wp.float32
    margin: wp.float32
    sees_motion: wp.int32
    tilt: wp.vec2
    tilt_offset: wp.vec2
    tilt_shake: wp.vec2
    correlation: wp.float32
    amplitude: wp.vec2
    tilt_uniform: wp.float32
    height_offset: wp.float32
    height_shake: wp.float32
    with_trunk: wp.int32
    forward: wp.float32
    mount_height: wp.float32
    pitch_down: wp.float32
    tan_half: wp.vec2
    far: wp.float32
    ceiling_share: wp.float32
    ceiling: wp.vec2


def write_rules(config: NavConfig) -> Any:
    """The record of ``Rules``."""
    motion, execution, episodes, camera = config.motion, config.execution, config.episodes, config.camera
    values = vars(config.robot) | vars(execution) | vars(motion) | vars(config.view)
    values |= {
        "success_radius": episodes.success_radius,
        "least": episodes.distance[0],
        "most": episodes.distance[1],
        "start_speed": episodes.start_speed,
        "execution_amplitude": execution.amplitude,
        "margin": config.reward.margin,
        "sees_motion": int(config.previous != "action"),
        "tilt_offset": motion.offset,
        "tilt_shake": motion.shake,
        "tilt_uniform": motion.uniform,
        "with_trunk": int(motion.with_trunk),
    }
    if camera is not None:
        view = {name: getattr(camera, name) for name in ("forward", "mount_height", "pitch_down", "far")}
        values |= view | {"tan_half": camera.record().tan_half}
    return fill_struct(Rules, values)


@wp.func
@no_type_check
def mix(between: wp.vec2, fraction: wp.float32) -> wp.float32:
    """From one end of a range to the other. Draws stay in the kernels: a function gets a copy of the random state, and
    what follows it would draw the same numbers again."""
    return between[0] + (between[1] - between[0]) * fraction


@wp.func
@no_type_check
def left_of(period: wp.float32, lag: wp.float32) -> wp.vec2:
    """How much of a step's old velocity is left with a first-order lag: in its mean, and at its end."""
    if lag <= 0.0:
        return wp.vec2(0.0, 0.0)
    last = wp.exp(-period / lag)
    return wp.vec2((1.0 - last) * lag / period, last)


@wp.func
@no_type_check
def place_after(
    start: wp.vec2, yaw: wp.float32, v: wp.float32, slip: wp.float32, w: wp.float32, push: wp.vec2, t: wp.float32
) -> wp.vec2:
    """Where a robot is after t seconds at constant speed and slip [m/s, along its heading] and push [m/s, world]."""
    half_turn = 0.5 * w * t
    chord = t
    if wp.abs(half_turn) > 1.0e-4:
        chord = t * wp.sin(half_turn) / half_turn
    c = wp.cos(yaw + half_turn)
    s = wp.sin(yaw + half_turn)
    return start + chord * wp.vec2(v * c - slip * s, v * s + slip * c) + t * push


@wp.func
@no_type_check
def sweep_touches(
    homes: Homes,
    home: wp.int32,
    rules: Rules,
    start: wp.vec2,
    yaw: wp.float32,
    v: wp.float32,
    slip: wp.float32,
    w: wp.float32,
    push: wp.vec2,
) -> wp.bool:
    """Whether the rectangle touches on its way; sub-poses at most 5 cm and 6 degrees apart."""
    swept = wp.max((wp.sqrt(v * v + slip * slip) + wp.length(push)) / 0.05, wp.abs(w) / 0.1) * rules.period
    steps = wp.max(wp.int32(wp.ceil(swept)), 1)
    hit = bool(False)
    k = int(1)
    while k <= steps and not hit:
        t = rules.period * wp.float32(k) / wp.float32(steps)
        p = place_after(start, yaw, v, slip, w, push, t)
        hit = touches(homes, home, p, yaw + w * t, rules.length, rules.width)
        k = k + 1
    return hit


@wp.kernel
@no_type_check
def move_robots(
    homes: Homes,
    rules: Rules,
    seed: wp.array(dtype=wp.int32),
    action: wp.array(dtype=wp.vec2),
    robots: Robots,
    moved: wp.array(dtype=wp.float32),
    blocked: wp.array(dtype=wp.float32),
    near: wp.array(dtype=wp.float32),
    straight: wp.array(dtype=wp.float32),
):
    """One step: constant speed, slip and yaw rate over the period. If the swept rectangle touches, it is cancelled as a
    whole, or all but its turn (``Robots.give_way``).

    Writes pose, velocity and distance of the robots, the path moved [m], 1 where it touched, 1 where something lies
    within the margin of where it ends, and the straight distance to the goal [m]. Where the goal cannot be reached from
    the new place, the distance stays as it was.
    """
    n = wp.tid()
    state = wp.rand_init(seed[0] + 4 * seed[1], n)
    home = robots.home[n]
    gain = robots.gain[n]
    a0 = wp.clamp(action[n][0], -1.0, 1.0)
    a1 = wp.clamp(action[n][1], -1.0, 1.0)
    v_command = (rules.min_speed + 0.5 * (a0 + 1.0) * (rules.max_speed - rules.min_speed)) * gain[0]
    w_command = a1 * rules.max_yaw_rate * gain[1]
    # first-order lags: the mean over the period, and the velocity at its end
    v_left = left_of(rules.period, rules.speed_lag)
    w_left = left_of(rules.period, rules.yaw_lag)
    v = v_command + (robots.speed[n] - v_command) * v_left[0]
    w = w_command + (robots.yaw_rate[n] - w_command) * w_left[0]
    v_end = v_command + (robots.speed[n] - v_command) * v_left[1]
    w_end = w_command + (robots.yaw_rate[n] - w_command) * w_left[1]
    pace = wp.abs(v) / rules.max_speed
    noisy = gain[3] * pace
    v = v + rules.speed_noise * wp.randn(state) * noisy
    if rules.min_speed == 0.0:
        v = wp.max(v, 0.0)
    slip = rules.side_slip * wp.randn(state) * noisy
    turning = 0.5 + 0.5 * wp.min(wp.max(pace, wp.abs(w) / rules.max_yaw_rate), 1.0)
    w = w + gain[2] * pace + rules.yaw_noise * wp.randn(state) * gain[3] * turning

    start = robots.position[n]
    yaw = robots.yaw[n]
    hit = sweep_touches(homes, home, rules, start, yaw, v, slip, w, wp.vec2(0.0, 0.0))
    moved[n] = wp.sqrt(v * v + slip * slip) * rules.period
    blocked[n] = 0.0
    p = place_after(start, yaw, v, slip, w, wp.vec2(0.0, 0.0), rules.period)
    if hit:
        # it stays; or turns where it stands, and what its corners meet pushes it back or aside
        p = start
        turned = bool(False)
        moved[n] = 0.0
        if robots.give_way[n] > 0.0:
            ahead = wp.vec2(wp.cos(yaw), wp.sin(yaw))
            aside = wp.vec2(-ahead[1], ahead[0])
            k = int(0)
            while k < 7 and not turned:
                pushed = 0.5 * robots.give_way[n] * wp.float32((k + 2) // 3)
                side = (k + 2) % 3
                to = wp.where(side == 0, -ahead, wp.where(side == 1, aside, -aside))
                push = to * (pushed / rules.period)
                if not sweep_touches(homes, home, rules, start, yaw, 0.0, 0.0, w, push):
                    turned = True
                    p = start + pushed * to
                    moved[n] = pushed
                k = k + 1
        if not turned:
            w = float(0.0)
            w_end = float(0.0)
        v = float(0.0)
        v_end = float(0.0)
        slip = float(0.0)
        blocked[n] = 1.0
    robots.twist[n] = wp.vec3(v, slip, w)
    seen = v
    if hit and rules.stopped_noise > 0.0:  # drawn only then: without it all else stays the same
        seen = rules.stopped_noise * gain[3] * wp.randn(state)
    heading = yaw + w * rules.period
    robots.previous[n] = wp.vec2(a0, a1)
    if rules.sees_motion != 0:
        fraction = (seen - rules.min_speed) / (rules.max_speed - rules.min_speed)
        robots.previous[n] = wp.vec2(
            wp.clamp(2.0 * fraction - 1.0, -1.0, 1.0), wp.clamp(w / rules.max_yaw_rate, -1.0, 1.0)
        )
    left = wp.sqrt(1.0 - rules.correlation * rules.correlation)
    new_roll = left * wp.randn(state)
    new_pitch = left * wp.randn(state)
    new_height = left * wp.randn(state)
    robots.sway[n] = rules.correlation * robots.sway[n] + wp.vec3(new_roll, new_pitch, new_height)
    robots.position[n] = p
    robots.yaw[n] = wp.atan2(wp.sin(heading), wp.cos(heading))
    robots.speed[n] = v_end
    robots.yaw_rate[n] = w_end
    distance = read_distance(homes, home, robots.goal[n], p)
    if distance < NOWHERE:
        robots.distance[n] = distance
    room = 2.0 * rules.margin
    near[n] = wp.where(touches(homes, home, p, heading, rules.length + room, rules.width + room), 1.0, 0.0)
    straight[n] = wp.length(homes.goals[home, robots.goal[n]] - p)


@wp.kernel
@no_type_check
def place_robots(
    homes: Homes,
    rules: Rules,
    seed: wp.array(dtype=wp.int32),
    chosen: wp.array(dtype=wp.bool),
    robots: Robots,
    unplaced: wp.array(dtype=wp.float32),
):
    """Start episodes of the chosen robots: random home, goal, start and heading until the distance lies in its range
    and the robot touches nothing; after many tries any start that leads to its goal."""
    n = wp.tid()
    if not chosen[n]:
        return
    state = wp.rand_init(seed[0] + 4 * seed[1] + 1, n)
    tries = int(0)
    found = bool(False)
    while not found:
        home = wp.randi(state, 0, homes.goals.shape[0])
        goal = wp.randi(state, 0, homes.goals.shape[1])
        p = homes.starts[home, wp.randi(state, 0, homes.starts.shape[1])]
        if tries < 128:  # later: the cells' centres, which are on the paths
            p = p + FIELD * wp.vec2(wp.randf(state) - 0.5, wp.randf(state) - 0.5)
        yaw = 6.2831853 * wp.randf(state) - 3.1415926
        distance = read_distance(homes, home, goal, p)
        # a start within the goal's radius would be no episode, whatever the range says
        far = distance < NOWHERE and wp.length(homes.goals[home, goal] - p) > rules.success_radius
        ranged = distance >= rules.least and distance <= rules.most
        free = far and not touches(homes, home, p, yaw, rules.length, rules.width)
        tries = tries + 1
        found = (ranged and free) or (tries >= 256 and free) or (tries >= 512 and far) or tries >= 1024
        if found:
            robots.home[n] = home
            robots.goal[n] = goal
            robots.position[n] = p
            robots.yaw[n] = yaw
            robots.distance[n] = distance
            if not (ranged and free):
                unplaced[n] = unplaced[n] + 1.0
    robots.speed[n] = mix(rules.start_speed, wp.randf(state))
    robots.yaw_rate[n] = 0.0
    robots.twist[n] = wp.vec3(0.0, 0.0, 0.0)
    drift = rules.yaw_drift * (2.0 * wp.randf(state) - 1.0)
    speed_gain = mix(rules.speed_gain, wp.randf(state))
    yaw_gain = mix(rules.yaw_gain, wp.randf(state))
    robots.gain[n] = wp.vec4(speed_gain, yaw_gain, drift, mix(rules.execution_amplitude, wp.randf(state)))
    robots.previous[n] = wp.vec2(0.0, 0.0)
    robots.amplitude[n] = mix(rules.amplitude, wp.randf(state))
    sway_roll = wp.randn(state)
    sway_pitch = wp.randn(state)
    sway_height = wp.randn(state)
    robots.sway[n] = wp.vec3(sway_roll, sway_pitch, sway_height)
    roll = rules.tilt[0] + rules.tilt_offset[0] * (2.0 * wp.randf(state) - 1.0)
    pitch = rules.tilt[1] + rules.tilt_offset[1] * (2.0 * wp.randf(state) - 1.0)
    height = rules.height_offset * (2.0 * wp.randf(state) - 1.0)
    ceiling = float(0.0)
    if wp.randf(state) < rules.ceiling_share:
        ceiling = mix(rules.ceiling, wp.randf(state))
    robots.mount[n] = wp.vec4(roll, pitch, height, ceiling)
    robots.give_way[n] = wp.where(wp.randf(state) < rules.held_share, 0.0, rules.give_way)


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
    rows: wp.array(dtype=wp.int32),
    position: wp.array(dtype=wp.vec3),
    rotation: wp.array(dtype=wp.mat33),
    depth: wp.array(dtype=wp.float16, ndim=3),
):
    """Depth along the optical axis as a fraction of the far limit, one thread a pixel, of the robots in ``rows``. Floor
    and ceiling are planes: no rays are lost on them, and none leaves a home through its floor."""
    k, row, column = wp.tid()
    n = rows[k]
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
    depth[k, row, column] = wp.float16(far / rules.far)
