"""Stage 3: a student with a camera in place of its teacher's map learns how fast it walks, in the same environment."""

from __future__ import annotations

from dataclasses import asdict

import torch

from vinl.config.errors import InputError
from vinl.config.loader import dump_config
from vinl.gait.config import GaitConfig
from vinl.gait.observation import SENSED_TABLE
from vinl.loco.config import LocoConfig
from vinl.loco.distillation import Distillation
from vinl.loco.environment import LocoEnvironment
from vinl.loco.student_config import StudentConfig
from vinl.loco.terrain_cameras import TerrainCameras, terrain_mesh
from vinl.loco.vec_env import CameraVecEnv
from vinl.loco.warm_start import load_teacher
from vinl.policies.card import describe_action, locomotion_card
from vinl.policies.io import save_policy
from vinl.policies.lineage import find_commit
from vinl.policies.networks import StepActor
from vinl.policies.stepping_actor import SteppingActor
from vinl.rl.loop import TrainingLoop
from vinl.rl.run_folder import RunFolder
from vinl.rl.stopwatch import Stopwatch

TEACHER = "teacher"
"""Folder inside the run that keeps the teacher, so that a run can be resumed without it."""

PROFILE_EVERY = 50
"""Iterations between those in which the parts are timed: to time them is to wait for the device."""


def describe_student_figures(row: dict[str, float]) -> dict[str, str]:
    """What the progress bar shows."""
    return {
        "samples/s": f"{row['samples_per_second']:,.0f}",
        "map": f"{row['loss/map_error']:.0%} off",
        "velocity": f"{row['loss/believed_rmse']:.3f} m/s",
        "feet/m": f"{row['foot_block_per_m']:.2f}",
        "falls/min": f"{row['falls_per_minute']:.2f}",
    }


def build_student(config: StudentConfig, teacher: StepActor, gait: GaitConfig) -> SteppingActor:
    """A fresh student in front of a teacher's actor and planner."""
    sizes = asdict(config.network)
    remember = sizes.pop("remember")
    student = SteppingActor(
        camera=config.camera.record().describe(),
        actor=teacher.arguments["actor"],
        actions=teacher.arguments["actions"],
        gait=asdict(gait),
        **sizes,
    )
    if remember:
        student.memory.spread_memory(remember)
    return student


def train_student(
    config: LocoConfig,
    run: RunFolder,
    resume: bool,
    device: str = "cpu",
    save_every: float = 60.0,
    iterations: int | None = None,
    minutes: float | None = None,
) -> bool:
    """Train a student, or go on with a run; arguments as for ``train_locomotor``.

    Returns:
        Whether the run is complete.

    Raises:
        InputError: there is no teacher, or it cannot be learned from.
    """
    settings = config.student
    assert settings is not None
    kept = run.path / TEACHER
    source = str(kept) if resume and kept.is_dir() else config.from_policy
    if source is None:
        raise InputError("stage 3 needs a teacher: give --from vinl/teacher, a policy folder or a run of stage 2")
    teacher, origin = load_teacher(source, config)
    if not resume:
        run.create(dump_config(config))
    action = describe_action(config.kp, config.kd)
    if not kept.is_dir():
        run.write_origin(asdict(origin))
        known = {"samples": origin.samples, "commit": origin.commit}
        card = locomotion_card(origin.policy, teacher.describe(), action, asdict(config.gait), **known)
        save_policy(kept, teacher, card)
    described = run.read_origin()
    torch.manual_seed(config.seed)
    torch.backends.cuda.matmul.allow_tf32 = torch.backends.cudnn.allow_tf32 = True
    stopwatch = Stopwatch(device)
    student = build_student(settings, teacher, config.gait)
    environment = LocoEnvironment(config)
    camera = settings.camera.record()
    mesh = terrain_mesh(environment.terrain)
    cameras = TerrainCameras(mesh, camera, settings.sensors, config.num_envs, device, config.seed)
    env = CameraVecEnv(environment, cameras, device, stopwatch)
    algorithm = Distillation(student, teacher, settings.distillation, config.num_envs, device, stopwatch)
    env.followed = algorithm.gait
    commit = find_commit()

    def export(policy: SteppingActor, samples: int) -> None:
        card = locomotion_card(
            run.path.name,
            policy.describe(),
            action,
            table=SENSED_TABLE,
            camera=camera.describe(),
            training={**dump_config(config), "origin": described},
            seed=config.seed,
            samples=samples,
            commit=commit,
        )
        save_policy(run.policy, policy, card)

    def schedule(learner: Distillation, fraction: float) -> None:
        learner.learning_rate = settings.distillation.rate_at(fraction)
        learner.teacher_fraction = settings.distillation.teacher_fraction_at(fraction)
        # the first iteration compiles: it would tell nothing
        stopwatch.running = loop.current_learning_iteration % PROFILE_EVERY == 1

    steps = settings.distillation.steps
    loop = TrainingLoop(
        env, algorithm, steps, run, device, export, describe_student_figures, schedule, save_every, stopwatch
    )
    if resume:
        loop.resume()
    return loop.train(iterations or config.iterations, minutes)
