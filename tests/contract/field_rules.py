"""What every field of every configuration may hold, and how to find out whether it takes that and nothing else.

Whether a value is harmful is told before it is tried, by the rules below: they are written from what the pages say of a
field, and know nothing of the code that checks it.
"""

import contextlib
import math
import signal
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from draccus.utils import DraccusException
from lerobot.configs import FeatureType, NormalizationMode, PolicyFeature

from lerobot_excav.cameras.mask_camera.config_mask_camera import MaskCameraConfig
from lerobot_excav.cameras.stream_camera.config_stream_camera import StreamCameraConfig
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.envs.configs.excavator import ExcavatorEnvConfig
from lerobot_excav.envs.configs.fr5_grasp import FR5GraspEnvConfig
from lerobot_excav.envs.soil.parameters import SoilParameters
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_testbed.config_excavator_testbed import ExcavatorTestbedConfig
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.scripts.main import COMMANDS, module_of
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_keyboard.config_excavator_keyboard import ExcavatorKeyboardConfig
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.excavator_web.config_excavator_web import ExcavatorWebConfig
from lerobot_excav.teleoperators.fr5_operator.config_fr5_operator import FR5OperatorConfig
from lerobot_excav.teleoperators.fr5_web.config_fr5_web import FR5WebConfig

ENDLESS, SEED = 2**31 - 1, 2**63 - 1
CPU_LIMIT_S = 2.0

POOL = {
    **{"none": None, "true": True, "false": False, "0": 0, "1": 1, "2": 2, "4": 4, "10": 10, "-1": -1, "0.0": 0.0},
    **{"-0.0": -0.0, "0.5": 0.5, "-0.5": -0.5, "2.5": 2.5, "1e-9": 1e-9, "1e300": 1e300, "-1e300": -1e300},
    **{"nan": math.nan, "inf": math.inf, "-inf": -math.inf, "10^12": 10**12, "2^63": 2**63, "10^5000": 10**5000},
    **{"-10^5000": -(10**5000), "empty": "", "typo": "typo", "text of a number": "1", "text of nan": "nan"},
    **{"bytes": b"x", "list": [], "list of a number": [1], "list of a text": ["a"], "list of nan": [math.nan]},
    **{
        "list of a list": [[1]],
        "map": {},
        "map to a number": {"a": 1},
        "tuple": (1, 2),
        "set": {1},
        "object": object(),
    },
    **{
        "path": Path("x"),
        "NUL": "a\0b",
        "NumPy 4": np.int64(4),
        "NumPy nan": np.float32("nan"),
        "NumPy true": np.True_,
    },
    **{"array": np.array([1, 2]), "complex": 1j, "type": int},
}


class Rule(NamedTuple):
    """What a field may hold."""

    allows: Any  # tells whether a value is harmless
    examples: tuple[Any, ...] = ()  # values near the limits
    needs: dict[str, Any] = {}  # noqa: RUF012 - other fields, without which it has no meaning
    is_text: bool = False  # whether the command line takes any text

    def beside(self, **needs):
        return self._replace(needs=needs)


def is_whole(value):
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def whole(low, high=SEED, only=None):
    return Rule(
        lambda v: is_whole(v) and low <= v <= high and (only is None or v in only), (low - 1, low, high, high + 1)
    )


def number(low=-math.inf, high=math.inf, *, above=-math.inf, below=math.inf):
    def allows(value):
        if not is_whole(value) and not (isinstance(value, float | np.floating) and math.isfinite(value)):
            return False
        return max(low, -1.7e308) <= value <= min(high, 1.7e308) and above < value < below

    finite = [edge for edge in (low, high, above, below) if math.isfinite(edge)]
    return Rule(allows, tuple(near for edge in finite for near in (edge, edge - 1e-6, edge + 1e-6)))


def one_of(*values):
    return Rule(lambda v: isinstance(v, str) and v in values, values)


def optional(rule):
    return rule._replace(allows=lambda v: v is None or rule.allows(v))


def each(rule):
    return Rule(lambda v: isinstance(v, list | tuple) and all(map(rule.allows, v)), tuple([e] for e in rule.examples))


def sizes(offsets, lengths, most=4096):
    """A list of so many offsets from 0 on, and of so many lengths from 16 on [px]."""
    least = [0] * offsets + [16] * lengths

    def allows(value):
        is_list = isinstance(value, list | tuple) and len(value) == len(least)
        return is_list and all(is_whole(v) and low <= v <= most for v, low in zip(value, least, strict=True))

    return Rule(
        allows, (least, [*least[:-1], 15], least[1:], [*least, 16], [*least[:-1], most], [*least[:-1], most + 1])
    )


def numbered(*names):
    """Names, each with a number of its own on a device."""

    def allows(value):
        is_map = isinstance(value, dict) and set(value) == set(names)
        return is_map and len(set(value.values())) == len(names) and all(map(whole(0, 255).allows, value.values()))

    right = {name: place for place, name in enumerate(names)}
    first = names[0]
    wrong = [{**right, first: bad} for bad in (-1, math.nan, "1", True, 1, 10**9)]
    return Rule(allows, (right, {first: 0}, {**right, "typo": 9}, *wrong))


flag = Rule(lambda v: isinstance(v, bool))
text = Rule(lambda v: isinstance(v, str) and v != "", is_text=True)
path = Rule(lambda v: isinstance(v, str | Path) and str(v) != "" and "\0" not in str(v), is_text=True)
never = Rule(lambda v: v is None)
feature_name = Rule(
    lambda v: isinstance(v, str) and v.startswith("observation.") and len(v) > 12 and " " not in v,
    ("observation.images.x", "observation.", "images.x", "observation.images.x y"),
)
device = Rule(
    lambda v: v in ("cpu", "cuda", "cuda:0", "mps", "xpu") if isinstance(v, str) else False, ("cpu", "cuda:x", "gpu")
)


def vector(name, kind, shape):
    return {name: PolicyFeature(type=kind, shape=shape)}


STATE, VISUAL, ACTION = FeatureType.STATE, FeatureType.VISUAL, FeatureType.ACTION
GOOD_SHAPES = [vector("observation.state", STATE, (8,)), vector("observation.images.a", VISUAL, (3, 9, 9)), {}, None]
BAD_SHAPES = [
    vector("observation.state", STATE, shape)
    for shape in [(), (0,), (-1,), (2.5,), (math.nan,), (10**12,), ("8",), (True,), (2, 2), None, 8]
]
BAD_SHAPES += [vector("observation.images.a", VISUAL, shape) for shape in [(9, 9), (3, 0, 9), (3, 9, 9, 9)]]
BAD_SHAPES += [{"observation.state": (8,)}, vector("observation.state", "STATES", (8,)), vector("", STATE, (8,))]
features = Rule(
    lambda v: any(v is good for good in GOOD_SHAPES) or (isinstance(v, dict) and not v), (*GOOD_SHAPES, *BAD_SHAPES)
)

MODES = dict.fromkeys(("VISUAL", "STATE", "ACTION"), NormalizationMode.MIN_MAX)
BAD_MODES = (
    {"STATE": NormalizationMode.MIN_MAX},
    MODES | {"VISION": NormalizationMode.MIN_MAX},
    MODES | {"STATE": "best"},
)
modes = Rule(lambda v: v is MODES, (MODES, *BAD_MODES))

POLICY = {
    "n_obs_steps": whole(1, 1),
    **dict.fromkeys(("input_features", "output_features"), features),
    "normalization_mapping": modes,
    "device": optional(device),
    **dict.fromkeys(("use_amp", "use_peft", "push_to_hub"), flag),
    "private": optional(flag),
    **dict.fromkeys(("repo_id", "license", "pretrained_revision"), optional(text)),
    "tags": optional(each(text)),
    "pretrained_path": optional(path),
    "chunk_size": whole(1, 10_000),
    "n_action_steps": optional(whole(1, 100)),  # of a chunk of 100
    "actions_per_token": optional(whole(1, 100, only=(1, 2, 4, 5, 10, 20, 25, 50, 100))),
    "temporal_ensemble_coeff": optional(
        number(-0.81, 10)._replace(examples=(-0.8, -0.82, 10, 10.1))
    ),  # exp(0.81 * 99) is a number
    "vision_backbone": optional(one_of("resnet_small", "resnet18", "resnet34", "resnet50", "resnet101", "resnet152")),
    "pretrained_backbone_weights": optional(one_of("ResNet18_Weights.IMAGENET1K_V1", "DEFAULT", "IMAGENET1K_V1")),
    "backbone_norm": optional(one_of("batch", "frozen")),
    "replace_final_stride_with_dilation": Rule(lambda v: v in (0, 1) if is_whole(v) else isinstance(v, bool)).beside(
        vision_backbone="resnet50"
    ),
    "dim_model": optional(whole(8, 16_384, only=range(0, 16_385, 8))),  # a multiple of 8 heads
    "n_heads": whole(1, 1024, only=(1, 2, 4, 8, 16, 32, 64, 128, 256, 512)),  # divides a width of 512
    "dim_feedforward": optional(whole(1, 65_536)),
    "feedforward_activation": one_of("relu", "gelu"),
    "n_encoder_layers": optional(whole(1, 100)),
    **dict.fromkeys(("n_decoder_layers", "n_vae_encoder_layers"), whole(1, 100)),
    **dict.fromkeys(("pre_norm", "use_vae"), optional(flag)),
    "latent_dim": whole(1, 16_384),
    "dropout": optional(number(0, below=1)),
    "kl_weight": number(0, 1e6),
    **dict.fromkeys(("optimizer_lr", "optimizer_lr_backbone"), optional(number(above=0, high=1))),
    "optimizer_weight_decay": number(0, 10),
    "lr_schedule": optional(one_of("constant", "cosine")),
    "lr_warmup_steps": optional(whole(0, ENDLESS)),
    **dict.fromkeys(("preset", "preset_applied"), optional(one_of("paper", "fast"))),
    "crop": optional(sizes(2, 2)),
    "resize_to": optional(sizes(0, 2)),
    "augment_shift_px": whole(0, 1024),
    "augment_mask_px": whole(0, 1024),
    "mask_shape": one_of("region", "box", "point"),
    "hold_mask_frames": whole(0, 10_000),
    "replan_iou": number(above=0, high=1),
    "compare_masks": flag,
    "backtrack_frames": whole(0, 10_000),
    "backtrack_stride": whole(1, 100).beside(backtrack_frames=5),
    "mask_key": feature_name,
    "main_camera": optional(feature_name),
    **dict.fromkeys(
        ("withhold_mask", "withhold_pictures", "target_token", "coordinate_channels", "optimizer_fused"), flag
    ),
}

TASK = {
    "fps": whole(1, 50, only=(1, 2, 5, 10, 25, 50)),
    "episode_length": optional(whole(1, ENDLESS)),
    **dict.fromkeys(("observation_height", "observation_width"), whole(32, 1024)),
    "scene_set": one_of("train", "val", "test"),
    "mask_source": one_of("oracle", "geometry", "manual", "grounded_sam"),
    "mask_options": optional(text),
    "mask_condition": one_of("correct", "zero", "random", "mismatched"),
    "mask_noise": one_of("shift", "erode", "dilate", "flicker").beside(mask_noise_px=3),  # none has no size
    "mask_noise_px": whole(1, 1024).beside(mask_noise="shift"),
    "mask_dropout": number(0, below=1),
    "mask_snap": flag,
    "target_overlay": flag,
}
SOIL = one_of("sand", "gravel", "dirt", "wet_sand")
ZONES = {"none", "-0.5,-3,1,-1.5", "0,0,1,1; 2,2,3,3.5"}
NO_ZONES = ("", "0,0,1", "0,0,0,1", "0,1,1,0", "0,0,1,inf", "nan,0,1,1", "0,0,1,1;", "0,0,1,1,2", "a,0,1,1", "4,0,5,1")
EXCAVATOR = {
    **TASK,
    **{"task": one_of("Scoop-v0", "Clear-v0"), "soil": SOIL, "fidelity": one_of("fast", "standard", "fine")},
    **{"density": one_of("light", "usual", "heavy"), "pile": one_of("heaps", "two_heaps", "ridge")},
    "mask_snap": Rule(lambda v: v is False),  # there is nothing on the ground to snap to
    "keep_out": Rule(lambda v: isinstance(v, str) and v in ZONES, (*ZONES, *NO_ZONES)).beside(task="Clear-v0"),
    "between_cycles": one_of("obey", "stand").beside(task="Clear-v0"),
    "retarget_frame": optional(whole(1, 199)),  # of 200 frames
}
FR5 = {**TASK, "task": one_of("FR5Grasp-v0"), "retarget_frame": optional(whole(1, 399))}  # of 400 frames
DERIVED = ("features", "features_map")  # from the other fields, whatever is given
ENV = {
    "metrics_path": optional(path),
    "metrics_episodes": optional(whole(1)).beside(metrics_path="x"),
    "render_mode": optional(one_of("rgb_array")),
    **dict.fromkeys(("render_height", "render_width"), whole(32, 1024)),
    "render_every": whole(1, 1000),
    "camera_every": whole(1, 1000),
    "film_folder": optional(text),
    "film_every": whole(1, 1000).beside(film_folder="films"),
    **dict.fromkeys(("film_height", "film_width"), whole(32, 1024).beside(film_folder="films")),
    "max_parallel_tasks": whole(1, 1),
    "disable_env_checker": flag,
}
LEROBOTS_OWN = ("id", "calibration_dir")
ROBOT = {
    "scene_id": whole(0, ENDLESS),
    "target_id": whole(0, 3),
    "stage": whole(0, 19),
    "advance": one_of("episode", "button"),
    "session_log": optional(path),
    "depth": flag,
    "episode_length": never,  # the command ends episodes
}
BUTTONS = [
    "a",
    "b",
    "x",
    "y",
    "guide",
    "leftstick",
    "rightstick",
    "leftshoulder",
    "rightshoulder",
    "dpad_up",
    "dpad_down",
    "dpad_left",
    "dpad_right",
]
AXES = ("left_x", "left_y", "right_x", "right_y")
JOYSTICK = {
    "pattern": one_of("iso", "sae"),
    "dead_zone": number(0, 0.99),
    "expo": number(0, 1),
    "invert": each(one_of(*AXES)),
    "reinitialise_button": one_of("back", *BUTTONS),  # start is the other one
    "next_scene_button": one_of("start", *BUTTONS),
    "device_name": optional(text),
    "device_index": optional(whole(0, 255)),
    "right_device_name": optional(text).beside(device_index=0),
    "right_device_index": optional(whole(0, 255)).beside(device_index=0),
    # One without the other says nothing.
    "joystick_axes": numbered(*AXES).beside(joystick_buttons={"back": 6, "start": 7}),
    "joystick_buttons": numbered("back", "start").beside(joystick_axes={axis: n for n, axis in enumerate(AXES)}),
}
SCENES = {
    "first_scene": whole(0, ENDLESS).beside(scenes=1),
    "scenes": whole(1, 100_000),
    "targets": optional(whole(1, 4)),
    "target_rule": one_of("round", "uniform", "nearest").beside(targets=1),
    "seed": whole(0, SEED),
}
GOOD_STAGES = ("0", "19", "0,4,8", "8, 0", "0,1-13", "3-3")
BAD_STAGES = ("5-3", "0-4,4", "1-20", "1-2-3", "20", "0,,4", "4,4", "-1", "1.5", "0;4", "²", "9" * 5000)


def is_stage_list(value):
    """Tell whether a value lists stages of the excavator, each once."""
    words = [word.strip() for word in value.split(",")] if isinstance(value, str) else []
    ranges = [word.split("-") for word in words]
    known = {str(number) for number in range(20)}
    if not words or not all(set(ends) <= known and len(ends) < 3 for ends in ranges):
        return False
    named = [stage for ends in ranges for stage in range(int(ends[0]), int(ends[-1]) + 1)]
    return all(int(ends[0]) <= int(ends[-1]) for ends in ranges) and len(set(named)) == len(named)


DEMOS = {
    **{**SCENES, "storage": optional(one_of("image", "video")), "keep_failures": flag},
    "retarget": number(0.0, 1.0),
    "retarget_times": whole(1, 20).beside(retarget=0.5),
    "retarget_late": number(0.0, 1.0).beside(retarget=0.5),
    "stages": Rule(is_stage_list, GOOD_STAGES + BAD_STAGES, is_text=True),
}
WORK = {"workers": whole(0, 1024)}
RESUMABLE = {**WORK, "resume": flag}
PAGE = {"host": text, "port": whole(0, 65535), "height": whole(96, 1440), "width": whole(128, 1920)}
ADDRESSES = ("127.0.0.1:47500", "127.9.9.9:1")  # of this computer, or somebody has to hold the dead-man
ELSEWHERE = "10.0.0.7:47500"
NO_ADDRESSES = ("", "machine", "127.0.0.1", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:²", "::1:9")
OWN_ADDRESS = Rule(lambda v: isinstance(v, str) and v in ADDRESSES, (*ADDRESSES, ELSEWHERE, *NO_ADDRESSES))
ANY_ADDRESS = Rule(lambda v: isinstance(v, str) and v in (*ADDRESSES, ELSEWHERE), OWN_ADDRESS.examples)
COMMAND_TABLES = {
    "demos": {**DEMOS, **RESUMABLE, "out": optional(path)},
    "operator": {**SCENES, **RESUMABLE, "metrics": optional(path)},
    "warmup": {},
    "bench": {
        **{**SCENES, **WORK, "json": optional(path)},
        "only": optional(one_of("environment", "writing", "demos")),
    },
    "alignment": dict.fromkeys(("dataset", "log", "out"), optional(path)),
    "masks": {
        **dict.fromkeys(("dataset", "out"), optional(path)),
        "source": optional(one_of("oracle", "click", "geometry", "manual", "grounded_sam", "vlm_dig")),
        "main_camera": optional(text),
    },
    "card": {
        "dataset": optional(path),
        **dict.fromkeys(("title", "push_to"), optional(text)),
        "license": text,
        **dict.fromkeys(("replays", "seed"), whole(0)),
        "private": optional(flag),
    },
    "qc": {"dataset": optional(path), "episodes": optional(each(whole(0))), "replays": whole(0), "seed": whole(0)},
    "index": {
        **dict.fromkeys(("dataset", "session", "out"), optional(path)),
        **dict.fromkeys(("skip_restarted", "recover", "include_failures", "flags"), flag),
        "task": optional(text),
        "operator": optional(one_of("scripted", "person", "policy")),
        "select": one_of("all", "paired", "non-paired", "balanced"),
        **dict.fromkeys(("episodes", "starts"), optional(whole(1))),
        "split": optional(one_of("scene", "episode")),
        "eval_fraction": optional(number(0, below=1)),
        "seed": optional(whole(0)),
    },
    "report": {
        "metrics": each(text),
        **dict.fromkeys(("rows", "metrics_folder", "videos_folder", "operator", "out"), optional(path)),
        "seed": whole(0),
    },
    "audit": {
        **dict.fromkeys(("checkpoint", "against", "out"), optional(path)),
        **{"first_scene": whole(0, ENDLESS), "scenes": whole(1, 10_000), "stage": whole(0, 1000), **WORK},
        **{"n_action_steps": each(whole(1)), "ensemble": optional(number(-10, 10)), "seed": whole(0, SEED)},
    },
    "console": {
        **dict.fromkeys(("policy", "out", "view"), optional(path)),
        **{
            "episode": whole(0),
            "first_scene": whole(0, ENDLESS).beside(scenes=1),
            "scenes": whole(1, 100_000),
            "targets": optional(whole(1, 4)),
        },
        "stages": Rule(lambda v: isinstance(v, str) and v != "", is_text=True),  # the environment decides
        **{**PAGE, "speed": number(0.1, 4.0), "open_browser": flag},
    },
    "segmenter": {
        **dict.fromkeys(("out", "model"), optional(path)),
        "env_types": Rule(
            lambda v: isinstance(v, str) and set(v.split(",")) <= {"excavator", "fr5_grasp", "toy_reach"} and v != "",
            ("excavator", "fr5_grasp", "excavator,fr5_grasp", "arm", "", ","),
        ),
        **{"scenes": whole(1, 10_000), "score_scenes": whole(1, 10_000), "steps": whole(10, 1_000_000)},
        **{"batch_size": whole(2, 1024), "seed": whole(0, 2**31 - 1)},
        "scene_set": one_of("train", "val", "test"),
    },
    "testbed-emulator": {
        "host": text,
        **dict.fromkeys(("port", "picture_port"), whole(0, 65535)),
        **{
            "first_scene": whole(0, ENDLESS),
            "pictures_hz": whole(1, 50, only=(1, 2, 5, 10, 25, 50)),
            "seed": whole(0, SEED),
        },
        **{"soak_s": number(0, 3600), "speed_limit": number(high=1, above=0)},
        **{"valve_lag_s": number(0, 5), "valve_dead_zone": number(0, below=1), "joint_noise_rad": number(0, 1)},
        **dict.fromkeys(("loss", "duplicates"), number(0, 1)),
        **dict.fromkeys(("delay_ms", "jitter_ms"), number(0, 10_000)),
        "metrics": optional(path),
        "calibration": optional(path),
    },
    "testbed-stop": {"address": ANY_ADDRESS},
    "export": {
        **dict.fromkeys(("checkpoint", "out", "results"), optional(path)),
        **dict.fromkeys(("title", "license"), text),
        "env": one_of("excavator", "fr5_grasp"),
    },
}
SAND = {
    "density_kg_m3": 1474.0,
    "friction_angle_rad": 0.6,
    "cohesion_pa": 0.0,
    "swell": 1.0,
    "steel_friction_angle_rad": 0.4,
}
SCALES = ("parcel_sliding_scale", "parcel_rolling_scale", "ground_sliding_scale", "ground_rolling_scale")
SOIL_TABLE = {
    "density_kg_m3": number(100, 5000),
    "friction_angle_rad": number(0.05, 1.2),
    "cohesion_pa": number(0, 1e5),
    "swell": number(1, 2),
    "steel_friction_angle_rad": number(0, 1.2),
    "parcel_solid_fraction": number(0.3, 1),
    **dict.fromkeys(SCALES, number(0, 10)),
    "penetration_scale": number(0, 100),
}

cameras = Rule(lambda v: isinstance(v, dict) and not v, ({},))  # LeRobot's own; those of this package check themselves

PICTURES = {"width": whole(1, 8192), "height": whole(1, 8192), "fps": whole(1, 1000)}

MASK_CAMERA = {**PICTURES, "of": text, "options": optional(text), "text": optional(text), "command": optional(path)}

CONFIGURATIONS = {
    "stream camera": (
        StreamCameraConfig,
        {
            **PICTURES,
            "name": text._replace(allows=lambda v: text.allows(v) and v.isprintable() and len(v) < 32),
            "port": whole(1, 65535),
            "host": text,
            **dict.fromkeys(("timeout_s", "max_age_s"), number(high=600, above=0)),
            "use_depth": flag,
        },
        {"name": "main", "port": 47501, "width": 128, "height": 96, "fps": 10},
    ),
    "mask camera": (
        MaskCameraConfig,
        MASK_CAMERA
        | {
            "source": one_of("oracle", "click", "manual", "grounded_sam"),
            "snap": flag,
            "calibration": optional(path),
            "targets": one_of("objects"),
            "keep_out": one_of("none"),
        },
        {"of": "top", "source": "manual", "width": 128, "height": 96},
    ),
    "mask camera of regions": (
        MaskCameraConfig,
        MASK_CAMERA
        | {
            "source": one_of("oracle", "geometry", "manual", "grounded_sam", "vlm_dig"),
            "snap": Rule(lambda v: v is False),
            "calibration": path,
            "targets": one_of("regions"),
            "keep_out": Rule(lambda v: isinstance(v, str) and v in ZONES, (*ZONES, *NO_ZONES)),
        },
        {
            "of": "top",
            "source": "geometry",
            "targets": "regions",
            "calibration": Path("main.toml"),
            "width": 128,
            "height": 96,
        },
    ),
    "mask_act": (MaskACTConfig, POLICY, {"device": "cpu"}),
    "excavator": (
        ExcavatorEnvConfig,
        EXCAVATOR | ENV | {"render_camera": one_of("overview", "side", "main", "cab", "overview_with_side")},
        {},
    ),
    "fr5_grasp": (FR5GraspEnvConfig, FR5 | ENV | {"render_camera": one_of("overview", "main", "top")}, {}),
    "excavator_sim": (ExcavatorSimConfig, EXCAVATOR | ROBOT | {"retarget_frame": optional(whole(1, ENDLESS))}, {}),
    "fr5_sim": (FR5SimConfig, FR5 | ROBOT | {"retarget_frame": optional(whole(1, ENDLESS)), "stage": whole(0, 0)}, {}),
    "excavator_testbed": (
        ExcavatorTestbedConfig,
        {
            "cameras": cameras,
            "address": OWN_ADDRESS,
            "dead_man": one_of("always", "gamepad"),
            **dict.fromkeys(("dead_man_device", "dead_man_button"), whole(0, 255)),
            **{"speed_limit": number(high=1, above=0), "ready_timeout_s": number(high=3600, above=0)},
            **{"alignment_log": optional(path), "release_stop": flag},
        },
        {},
    ),
    "excavator_joystick": (ExcavatorJoystickConfig, JOYSTICK, {}),
    "excavator_operator": (ExcavatorOperatorConfig, {"seed": whole(0)}, {}),
    "excavator_keyboard": (
        ExcavatorKeyboardConfig,
        {"pattern": one_of("iso", "sae"), "speed": number(high=1, above=0)},
        {},
    ),
    "excavator_web": (ExcavatorWebConfig, PAGE, {}),
    "fr5_web": (FR5WebConfig, PAGE, {}),
    "fr5_operator": (FR5OperatorConfig, {"seed": whole(0)}, {}),
    "soil": (SoilParameters, SOIL_TABLE, SAND),
    "demonstrations": (DemonstrationSettings, DEMOS, {"env": ExcavatorSettings()}),
}
COMMAND_ARGUMENTS = {name: module_of(name).ARGUMENTS for name in COMMANDS}
CONFIGURATIONS |= {f"lerobot-excav {name}": (COMMAND_ARGUMENTS[name], COMMAND_TABLES[name], {}) for name in COMMANDS}


@contextlib.contextmanager
def cpu_limit():
    """Raise TimeoutError within what hangs: after so much processor time, however loaded the machine is."""

    def interrupt(*_):
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, interrupt)
    signal.setitimer(signal.ITIMER_PROF, CPU_LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def problem(make, *, is_harmless, name, shown=""):
    """Return what is wrong with how a value was taken, if something is; `shown` has to stand in a refusal."""
    try:
        with cpu_limit():
            make()
    except (ConfigurationError, DraccusException) as error:
        message = str(error)
        if is_harmless:
            return f"refused though harmless: {message}"
        if name not in message or shown not in message:
            return f"the refusal does not name field and value: {message}"
        return "more than one line" if isinstance(error, ConfigurationError) and "\n" in message else None
    except TimeoutError:
        return "hangs"
    except Exception as error:  # whatever a raw exception is
        return f"raw {type(error).__name__}: {error}"
    return None if is_harmless else "accepted though harmful"


def problems(kind, table, base):
    """Try every value on every field."""
    found = []
    for name, rule in table.items():
        values = {**POOL, **{f"example {place}": value for place, value in enumerate(rule.examples)}}
        for label, value in values.items():
            needs = {key: need for key, need in {**base, **rule.needs}.items() if key != name}
            wrong = problem(
                lambda needs=needs, name=name, value=value: kind(**needs, **{name: value}),
                is_harmless=rule.allows(value),
                name=name,
                shown=repr(value)[:20] if isinstance(value, float | str) else "",
            )
            if wrong is not None:
                found.append(f"{name} = {label}: {wrong}")
    return found
