"""The page: a viser server that shows a session and hands on what its visitors ask for."""

from __future__ import annotations

import contextlib
import io
import math
import socket
import threading
import time
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
import viser
from PIL import Image

from vinl.chain.navigators.base import Navigator
from vinl.config.errors import InputError
from vinl.policies.policy import Policy
from vinl.render.panels import colour_depth
from vinl.viewer.controls import CLICKS, Controls, ReplayControls
from vinl.viewer.scene_view import LAYERS, SceneView
from vinl.viewer.session import Session, Snapshot

_COLOURS = {
    "standing": "#64748b",
    "walking": "#2563eb",
    "driven": "#b45309",
    "reached": "#16a34a",
    "fallen": "#dc2626",
    "recorded": "#7c3aed",
}
_ROW = (
    '<tr><td style="color:#64748b;padding:1px 8px 1px 0">{0}</td>'
    '<td id="vinl-{1}" style="text-align:right;font-weight:600">{2}</td></tr>'
)


def describe_state(snapshot: Snapshot) -> str:
    """What the robot is about, in a few words."""
    if snapshot.state == "fallen":
        return "fallen: press Reset"
    return f"{snapshot.state}, paused" if snapshot.paused else snapshot.state


def list_figures(snapshot: Snapshot) -> list[tuple[str, str, str]]:
    """Name, key and text of each figure."""
    goal = "none: click the floor" if snapshot.duration_s is None else "-"
    if snapshot.goal is not None:
        goal = f"{np.linalg.norm(snapshot.goal - snapshot.qpos[:2]):.2f} m away"
    time = f"{snapshot.time_s:.2f} s"
    if snapshot.duration_s is not None:
        time += f" of {snapshot.duration_s:.1f} s"
    foot, leg, trunk = snapshot.contact_steps
    speed, turn = snapshot.velocity[0], math.degrees(snapshot.velocity[2])
    x, y = snapshot.qpos[:2]
    factor = "paused" if snapshot.paused else f"{snapshot.real_time:.2f}, {snapshot.step_ms:.1f} ms a step"
    return [
        ("goal", "goal", goal),
        ("time", "time", time),
        ("robot at x, y", "place", f"{x:.2f}, {y:.2f} m"),
        ("walked", "distance", f"{snapshot.distance_m:.2f} m"),
        ("commanded", "command", f"{snapshot.command[0]:.2f} m/s, {math.degrees(snapshot.command[2]):+.0f} °/s"),
        ("measured", "velocity", f"{speed:.2f} m/s, {turn:+.0f} °/s"),
        ("blocks", "blocks", str(len(snapshot.world.blocks))),
        ("contact steps: foot, leg, trunk", "contacts", f"{foot}, {leg}, {trunk}"),
        ("real-time factor", "factor", factor),
    ]


def render_status(snapshot: Snapshot) -> str:
    """State and figures as a table. Every figure's cell has an id, ``vinl-`` and its key."""
    colour = _COLOURS[snapshot.state]
    badge = (
        f'<div id="vinl-state" style="background:{colour};color:white;border-radius:6px;padding:3px 10px;'
        f'font-weight:600;margin-bottom:6px">{escape(describe_state(snapshot))}</div>'
    )
    rows = "".join(_ROW.format(escape(name), key, escape(text)) for name, key, text in list_figures(snapshot))
    table = (
        '<table style="width:100%;border-collapse:collapse;font-size:12.5px;font-variant-numeric:tabular-nums">'
        f"{rows}</table>"
    )
    return f'<div style="padding:0 0.75em 0.3em">{badge}{table}</div>'


DRAW_RATE = 30.0
"""Pictures of the scene a second at most."""

TEXT_RATE = 5.0
"""Figures and camera images are renewed so many times a second at most."""

_IMAGE_WIDTH = 320
_CAMERA, _FIELD = (-3.0, -2.2, 2.6), math.radians(50)
"""Where the camera begins, seen from the robot [m], and its vertical field of view [rad]."""


class Viewer:
    """A session, started or not yet, in the browser, on a port of an address (port 0: any free one; ``0.0.0.0`` lets
    other machines in), at ``url``. ``shown`` is the snapshot that was drawn last, ``error`` what ended the drawing, if
    anything did. Raises ``InputError`` if the port is taken, or may not be used."""

    def __init__(self, session: Session, title: str, host: str = "127.0.0.1", port: int = 8080) -> None:
        self.session, self._closing = session, threading.Event()
        self.shown: Snapshot | None = None
        self.error: BaseException | None = None
        self._server = open_server(host, port, title)
        shown = "localhost" if host in ("0.0.0.0", "127.0.0.1") else host
        self.url = f"http://{shown}:{self._server.get_port()}"
        gui = self._server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
        self.scene = SceneView(self._server.scene)
        camera = self._server.initial_camera
        camera.position, camera.look_at, camera.fov = _CAMERA, (0.0, 0.0, 0.15), _FIELD
        panel = gui.add_panel()
        with panel.add_tab("Robot", viser.Icon.ROBOT):
            self._status = gui.add_html(render_status(session.snapshot))
            blank = np.zeros((_IMAGE_WIDTH // 2, _IMAGE_WIDTH, 3), np.uint8)
            self._images = {
                name: gui.add_image(blank, label=f"{name} camera: bright is near", format="png")
                for name in ("locomotion", "navigation")
            }
        panel.dock_left()
        panel.set_width(330)
        gui.main_panel.dock_right()
        self._controls: Controls | ReplayControls | None = None
        self._thread = threading.Thread(target=self._run, name="vinl viewer", daemon=True)

    def add_controls(
        self,
        plans: Sequence[str],
        locomotion: Mapping[str, str | Policy],
        navigation: Mapping[str, str | Navigator],
        obstacles: str,
    ) -> None:
        """The panel of a live session, see ``Controls``, and clicks on the floor."""
        controls = Controls(self._server.gui, self.session.ask, plans, locomotion, navigation, obstacles)
        self._controls = controls
        self._add_view(list(LAYERS))
        scene = self._server.scene
        scene.on_click()(lambda event: self._click(event, controls.click))
        scene.on_click(modifier="shift")(lambda event: self._click(event, "block"))

    def add_replay_controls(self, labels: Sequence[str], number: int) -> None:
        """The panel of a recording, see ``ReplayControls``."""
        self._controls = ReplayControls(self._server.gui, self.session.ask, labels, number, self.session.snapshot)
        self._add_view([name for name in LAYERS if name not in ("forces", "footholds", "occupied")])

    def start(self) -> Viewer:
        """Draw from now on."""
        self._thread.start()
        return self

    def close(self) -> None:
        """End the session and the server."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()
        self.session.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self._server.stop()

    def wait(self) -> None:
        """Until the session or the drawing fails, whose error is raised."""
        while True:
            error = self.session.error or self.error
            if error is not None:
                raise error
            time.sleep(0.2)

    def __repr__(self) -> str:
        return f"Viewer({self.url})"

    def _repr_html_(self) -> str:
        """In a notebook: the page in a frame."""
        return f'<iframe src="{self.url}" width="100%" height="640" style="border:0;border-radius:8px"></iframe>'

    # ---- what visitors do ------------------------------------------------------------------------------------------

    def _click(self, event: viser.SceneClickEvent, what: str) -> None:
        found = meet_floor(self.scene, event)
        if found is not None:
            self.session.ask(CLICKS[what](*found))

    def _add_view(self, layers: Sequence[str]) -> None:
        gui = self._server.gui
        with gui.add_folder("View", expand_by_default=False):
            buttons = gui.add_button_group("Camera", ("Follow", "Overview"))
            boxes = {name: gui.add_checkbox(LAYERS[name], initial_value=name != "cameras") for name in layers}
        buttons.on_click(lambda event: self._look(event.target.value, event.client))
        for name, box in boxes.items():
            box.on_update(lambda event, name=name: self.scene.show(name, event.target.value))

    def _look(self, where: str, client: viser.ClientHandle | None) -> None:
        if where == "Follow":
            self.scene.follows = True
            place: tuple[float, float, float] = _CAMERA
        else:
            self.scene.centre_plan()
            place = (0.0, -0.35 * self.scene.extent, 1.05 * self.scene.extent)
        if client is not None:
            with client.atomic():
                client.camera.position, client.camera.look_at = place, (0.0, 0.0, 0.0)

    # ---- what they see ---------------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            self._draw()
        except Exception as error:  # whoever waits is told
            self.error = error

    def _draw(self) -> None:
        told, noticed = 0.0, self.session.snapshot.notice[0]
        while not self._closing.is_set():
            snapshot = self.session.snapshot
            now = time.perf_counter()
            if snapshot is not self.shown:
                with self._server.atomic():
                    self.scene.draw(snapshot)
                    if now - told > 1 / TEXT_RATE or snapshot.paused:
                        self._tell(snapshot)
                        told = now
                self.shown = snapshot
            if snapshot.notice[0] != noticed:
                noticed = snapshot.notice[0]
                for client in self._server.get_clients().values():
                    client.add_notification(snapshot.notice[1], "", auto_close_seconds=4.0)
            self._closing.wait(max(0.0, 1 / DRAW_RATE - (time.perf_counter() - now)))

    def _tell(self, snapshot: Snapshot) -> None:
        """Figures and images."""
        self._status.content = render_status(snapshot)
        if self._controls is not None:
            self._controls.follow(snapshot)
        pictures = {}
        for name, image in snapshot.images.items():
            picture = colour_depth(image.depth, image.camera.far)
            size = (_IMAGE_WIDTH, round(_IMAGE_WIDTH * picture.shape[0] / picture.shape[1]))
            self._images[name].image = np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.NEAREST))
            pictures[name] = (image.camera, picture)
        self.scene.draw_images(pictures)


def meet_floor(scene: SceneView, event: viser.SceneClickEvent) -> tuple[float, float] | None:
    """Where the ray of a click meets the floor, in the world of the plan [m]; None above the horizon."""
    origin, ray = np.array(event.ray_origin), np.array(event.ray_direction)
    if ray[2] > -1e-3:
        return None
    x, y, _ = scene.to_world(origin - ray * (origin[2] / ray[2]))
    return float(x), float(y)


def open_server(host: str, port: int, title: str) -> viser.ViserServer:
    """A viser server on exactly this port; viser itself would take the next free one. Raises ``InputError`` if the port
    is taken, or may not be used, or there is no such address here."""
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((host, port))
        except (OSError, OverflowError) as error:
            why = error.strerror if isinstance(error, OSError) else "no such port"
            raise InputError(
                f"--port {port} on {host} cannot be used ({why}); choose another, 0 for any free one"
            ) from None
    with contextlib.redirect_stdout(io.StringIO()):
        return viser.ViserServer(host=host, port=port, label=title, verbose=False)
