"""The Warp kernel of the ray renderer. A file of its own: Warp compiles it, Python never runs it."""

# pyright: reportInvalidTypeForm=false, reportCallIssue=false, reportArgumentType=false
# pyright: reportOperatorIssue=false, reportIndexIssue=false, reportAttributeAccessIssue=false

from typing import no_type_check

import warp as wp

from vinl.sensing.warp_start import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})  # nobody differentiates a picture; compiles in half the time


@wp.func
@no_type_check
def sky(direction: wp.vec3):
    """Almost white at the horizon, light blue overhead."""
    a = wp.clamp(direction[2] / wp.length(direction), 0.0, 1.0)
    return wp.vec3(0.93, 0.94, 0.95) * (1.0 - a) + wp.vec3(0.62, 0.75, 0.90) * a


@wp.func
@no_type_check
def near_sphere(origin: wp.vec3, direction: wp.vec3, centre: wp.vec3, radius: float, limit: float):
    """Whether a ray passes through a ball before its parameter reaches the limit; direction has unit length."""
    along = wp.dot(centre - origin, direction)
    gap = centre - origin - direction * along
    return wp.dot(gap, gap) < radius * radius and along > -radius and along - radius < limit


@wp.kernel
@no_type_check
def render_picture(
    world: wp.uint64,
    face_colour: wp.array(dtype=wp.vec3),
    floor_low: wp.vec2,
    floor_high: wp.vec2,
    floor_colour: wp.vec3,
    checker: float,
    body_mesh: wp.array(dtype=wp.uint64),
    body_frame: wp.array(dtype=int),
    body_colour: wp.array(dtype=wp.vec3),
    body_centre: wp.array(dtype=wp.vec3),
    body_radius: wp.array(dtype=float),
    body_first: wp.array(dtype=int),
    corner_normal: wp.array(dtype=wp.vec3),
    frame_position: wp.array(dtype=wp.vec3),
    frame_rotation: wp.array(dtype=wp.mat33),
    robot_centre: wp.vec3,
    robot_radius: float,
    eye: wp.vec3,
    turn: wp.mat33,
    tan_half: wp.vec2,
    sun: wp.vec3,
    far: float,
    shadows: int,
    samples: int,
    picture: wp.array(dtype=wp.uint8, ndim=3),
):
    """One thread a pixel, samples x samples rays each."""
    row, column = wp.tid()
    total = wp.vec3(0.0, 0.0, 0.0)
    for sample in range(samples * samples):
        du = (float(sample % samples) + 0.5) / float(samples)
        dv = (float(sample // samples) + 0.5) / float(samples)
        left = tan_half[0] * (1.0 - 2.0 * (float(column) + du) / float(picture.shape[1]))
        up = tan_half[1] * (1.0 - 2.0 * (float(row) + dv) / float(picture.shape[0]))
        ray = wp.normalize(turn * wp.vec3(1.0, left, up))
        t = far
        colour = sky(ray)
        normal = wp.vec3(0.0, 0.0, 0.0)
        gloss = wp.float32(0.0)
        # The floor is a plane and not two triangles: what it hides need not be searched for in the mesh.
        if ray[2] < 0.0 and eye[2] > 0.0:
            below = -eye[2] / ray[2]
            p = eye + ray * below
            inside = p[0] >= floor_low[0] and p[0] <= floor_high[0] and p[1] >= floor_low[1] and p[1] <= floor_high[1]
            if inside and below < far:
                t = below
                normal = wp.vec3(0.0, 0.0, 1.0)
                colour = floor_colour
                odd = (int(wp.floor(p[0] / checker)) + int(wp.floor(p[1] / checker))) % 2 != 0
                if odd:
                    colour = colour * 0.88
        static = wp.mesh_query_ray(world, eye, ray, t)
        if static.result:
            t = static.t
            normal = static.normal
            colour = face_colour[static.face]
        if near_sphere(eye, ray, robot_centre, robot_radius, t):
            for body in range(body_mesh.shape[0]):
                frame = body_frame[body]
                inverse = wp.transpose(frame_rotation[frame])
                o = inverse * (eye - frame_position[frame])
                d = inverse * ray
                if near_sphere(o, d, body_centre[body], body_radius[body], t):
                    hit = wp.mesh_query_ray(body_mesh[body], o, d, t)
                    if hit.result:
                        t = hit.t
                        corner = 3 * (body_first[body] + hit.face)
                        smooth = (
                            corner_normal[corner] * hit.u
                            + corner_normal[corner + 1] * hit.v
                            + corner_normal[corner + 2] * (1.0 - hit.u - hit.v)
                        )
                        normal = frame_rotation[frame] * wp.normalize(smooth)
                        colour = body_colour[body]
                        gloss = 0.35
        if t < far:
            if wp.dot(normal, ray) > 0.0:
                normal = -normal
            light = wp.max(wp.dot(normal, sun), 0.0)
            point = eye + ray * t + normal * 0.001
            if shadows > 0 and light > 0.0:
                dark = wp.int32(0)
                if near_sphere(point, sun, robot_centre, robot_radius, far):
                    for body in range(body_mesh.shape[0]):
                        if dark == 0:
                            frame = body_frame[body]
                            inverse = wp.transpose(frame_rotation[frame])
                            o = inverse * (point - frame_position[frame])
                            d = inverse * sun
                            inside = near_sphere(o, d, body_centre[body], body_radius[body], far)
                            if inside and wp.mesh_query_ray_anyhit(body_mesh[body], o, d, far):
                                dark = 1
                if shadows > 1 and dark == 0 and wp.mesh_query_ray_anyhit(world, point, sun, far):
                    dark = 1
                if dark == 1:
                    light = light * 0.25
                    gloss = 0.0
            # Light from above is brighter than light from the floor.
            ambient = 0.50 + 0.10 * normal[2]
            half_way = wp.normalize(sun - ray)
            shine = gloss * wp.pow(wp.max(wp.dot(normal, half_way), 0.0), 24.0)
            colour = colour * (ambient + 0.52 * light) + wp.vec3(shine, shine, shine)
            haze = wp.clamp((t - 12.0) / 40.0, 0.0, 1.0)
            colour = colour * (1.0 - haze) + sky(ray) * haze
        total = total + colour
    total = total / float(samples * samples)
    for channel in range(3):
        picture[row, column, channel] = wp.uint8(255.0 * wp.clamp(total[channel], 0.0, 1.0))
