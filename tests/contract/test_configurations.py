"""Every field of every configuration takes what its page allows, and refuses anything else by name, at once."""

import dataclasses
import math

import draccus
import pytest
from draccus.cfgparsing import parse_string

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.result_page.contents import read_contents
from lerobot_excav.scripts.arguments import parse_arguments
from lerobot_excav.scripts.main import COMMANDS

from . import field_rules
from .field_rules import (
    COMMAND_TABLES,
    CONFIGURATIONS,
    DERIVED,
    ENDLESS,
    LEROBOTS_OWN,
    POOL,
    Rule,
    each,
    number,
    one_of,
    path,
    problem,
    problems,
    text,
    whole,
)
<<<<<<< HEAD
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
    "mask_key": feature_name,
    "main_camera": optional(feature_name),
    **dict.fromkeys(("withhold_mask", "target_token", "coordinate_channels", "optimizer_fused"), flag),
}

TASK = {
    "fps": whole(1, 50, only=(1, 2, 5, 10, 25, 50)),
    "episode_length": optional(whole(1, ENDLESS)),
    **dict.fromkeys(("observation_height", "observation_width"), whole(32, 1024)),
    "scene_set": one_of("train", "val", "test"),
    "mask_source": one_of("oracle"),
    "mask_condition": one_of("correct", "zero", "random", "mismatched"),
    "mask_noise": one_of("shift", "erode", "dilate").beside(mask_noise_px=3),  # none has no size
    "mask_noise_px": whole(1, 1024).beside(mask_noise="shift"),
    "target_overlay": flag,
}
SOIL = one_of("sand", "gravel", "dirt", "wet_sand")
EXCAVATOR = {**TASK, "task": one_of("Scoop-v0"), "soil": SOIL, "fidelity": one_of("fast", "standard", "fine")}
FR5 = {**TASK, "task": one_of("FR5Grasp-v0"), "retarget_frame": optional(whole(1, 399))}  # of 400 frames
DERIVED = ("features", "features_map")  # from the other fields, whatever is given
ENV = {
    "metrics_path": optional(path),
    "metrics_episodes": optional(whole(1)).beside(metrics_path="x"),
    "render_mode": optional(one_of("rgb_array")),
    "max_parallel_tasks": whole(1, 1),
    "disable_env_checker": flag,
}
LEROBOTS_OWN = ("id", "calibration_dir")
ROBOT = {
    "scene_id": whole(0, ENDLESS),
    "target_id": whole(0, 3),
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
    # One without the other says nothing.
    "joystick_axes": numbered(*AXES).beside(joystick_buttons={"back": 6, "start": 7}),
    "joystick_buttons": numbered("back", "start").beside(joystick_axes={axis: n for n, axis in enumerate(AXES)}),
}
SCENES = {
    "first_scene": whole(0, ENDLESS).beside(scenes=1),
    "scenes": whole(1, 100_000),
    "targets": whole(1, 4),
    "target_rule": one_of("round", "uniform").beside(targets=1),  # the excavator tells no target as the nearest
    "seed": whole(0, SEED),
}
DEMOS = {**SCENES, "storage": optional(one_of("image", "video")), "keep_failures": flag}
WORK = {"workers": whole(0, 1024)}
RESUMABLE = {**WORK, "resume": flag}
COMMAND_TABLES = {
    "demos": {**DEMOS, **RESUMABLE, "out": optional(path)},
    "operator": {**SCENES, **RESUMABLE, "metrics": optional(path)},
    "bench": {
        **{**SCENES, **WORK, "json": optional(path)},
        "only": optional(one_of("environment", "writing", "demos")),
    },
    "qc": {"dataset": optional(path), "episodes": optional(each(whole(0))), "replays": whole(0), "seed": whole(0)},
    "index": {
        **dict.fromkeys(("dataset", "session", "out"), optional(path)),
        **dict.fromkeys(("skip_restarted", "include_failures", "flags"), flag),
        "select": one_of("all", "paired", "non-paired", "balanced"),
        **dict.fromkeys(("episodes", "scenes"), optional(whole(1))),
        "split": optional(one_of("scene", "episode")),
        "eval_fraction": optional(number(0, below=1)),
        "seed": optional(whole(0)),
    },
    "report": {
        "metrics": each(text),
        **dict.fromkeys(("rows", "metrics_folder", "operator", "out"), optional(path)),
        "seed": whole(0),
    },
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

CONFIGURATIONS = {
    "mask_act": (MaskACTConfig, POLICY, {"device": "cpu"}),
    "excavator": (ExcavatorEnvConfig, EXCAVATOR | ENV, {}),
    "fr5_grasp": (FR5GraspEnvConfig, FR5 | ENV, {}),
    "excavator_sim": (ExcavatorSimConfig, EXCAVATOR | ROBOT, {}),
    "fr5_sim": (FR5SimConfig, FR5 | ROBOT | {"retarget_frame": optional(whole(1, ENDLESS))}, {}),
    "excavator_joystick": (ExcavatorJoystickConfig, JOYSTICK, {}),
    "excavator_operator": (ExcavatorOperatorConfig, {"seed": whole(0)}, {}),
    "fr5_operator": (FR5OperatorConfig, {"seed": whole(0)}, {}),
    "soil": (SoilParameters, SOIL_TABLE, SAND),
    "demonstrations": (DemonstrationSettings, DEMOS, {"env": ExcavatorSettings()}),
}
COMMAND_ARGUMENTS = {name: importlib.import_module(f"lerobot_excav.scripts.{name}").ARGUMENTS for name in COMMANDS}
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
=======
>>>>>>> main


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_every_field_is_in_the_table(name):
    kind, table, _ = CONFIGURATIONS[name]
    known = {field.name for field in dataclasses.fields(kind)}
    assert known - {"env", *DERIVED, *LEROBOTS_OWN} - ({"env"} if name != "lerobot-excav export" else set()) <= set(
        table
    )
    assert set(table) <= known


@pytest.mark.parametrize("name", CONFIGURATIONS)
def test_a_field_takes_what_is_harmless_and_refuses_the_rest_by_name(name):
    found = problems(*CONFIGURATIONS[name])
    assert found == [], "\n".join(found)


NESTED = "9" * 5000
TEXTS = {
    **{"nan": math.nan, "1e400": math.inf, "-0": 0, "7": 7, "-1": -1, "2.5": 2.5, "true": True, "false": False},
    **{"null": None, "typo": "typo", "[]": [], "[1]": [1], "[nan]": [math.nan], "{}": {}, "": "", "9" * 30: 10**30 - 1},
    NESTED: 10**5000,
}
"""What stands on a command line, and what it means where a number, a list or a truth value is asked for."""


@pytest.mark.parametrize("command", COMMANDS)
def test_an_option_takes_what_is_harmless_and_refuses_the_rest_by_name(command):
    kind, table, _ = CONFIGURATIONS[f"lerobot-excav {command}"]
    found = []
    for name, rule in table.items():
        if command in ("operator", "bench") and (name, rule) in COMMAND_TABLES["demos"].items():
            continue  # the same option, tried there
        for word, meaning in TEXTS.items():
            if name == "metrics" and meaning and isinstance(meaning, list):
                continue  # files called 1 and nan
            value = meaning if word in ("", "null") or not rule.is_text else word
            needs = [f"--{key}={need}" for key, need in rule.needs.items()]
            wrong = problem(
                lambda argv=[*needs, f"--{name}={word}"]: parse_arguments(kind, argv, command=command, description=""),
                is_harmless=rule.allows(value),
                name=name,
            )
            if wrong is not None:
                found.append(f"--{name}={word:.40}: {wrong}")
    assert found == [], "\n".join(found)


@pytest.mark.parametrize("name", [name for name in CONFIGURATIONS if name not in ("soil", "demonstrations")][:8])
def test_lerobots_parser_leaves_nothing_harmful(name):
    """Its own reading of a text stands: it makes 1 of `true`, and text of anything."""
    kind, table, base = CONFIGURATIONS[name]
    found = []
    for field, rule in table.items():
        for word, meaning in TEXTS.items():
            if rule.is_text or word in (NESTED, "true", "false") or not (rule.allows(meaning) or is_wrong(meaning)):
                continue
            wrong = problem(
                lambda field=field, rule=rule, word=word: draccus.decode(
                    kind, {**base, **rule.needs, field: parse_string(word)}
                ),
                is_harmless=rule.allows(meaning),
                name=field,
            )
            if wrong is not None:
                found.append(f"{field}={word:.40}: {wrong}")
    assert found == [], "\n".join(found)


def is_wrong(meaning):
    """Tell whether a value is wrong in every field that does not allow it, however it is read."""
    return isinstance(meaning, float | int | dict)


PAGE = {"title": "t", "metrics": "m"}
ROW = {"label": "a", "about": "x"}
file_name = Rule(
    lambda v: isinstance(v, str) and v != "" and not set(v) & set("/\\\0\n") and v[0] != ".",
    ("a b", "../a", "a/b", ".a", "..", "\\a", "a\nb"),
)
any_text = Rule(lambda v: isinstance(v, str), is_text=True)
LISTS = Rule(lambda v: v == [])
PAGE_TABLES = {
    "title": (text, lambda v: {**PAGE, "title": v}),
    "metrics": (path, lambda v: {**PAGE, "metrics": v}),
    "text": (any_text, lambda v: {**PAGE, "text": v}),
    **{name: (LISTS, lambda v, name=name: {**PAGE, name: v}) for name in ("section", "curve", "clips")},
    "label": (file_name, lambda v: page({**ROW, "label": v})),
    "about": (text, lambda v: page({**ROW, "about": v})),
    "success": (number(), lambda v: page({**ROW, "paper": {"success": v}})),
    "reference": (one_of("a"), lambda v: page(ROW, reference=v)),
    "rows": (LISTS, lambda v: {**PAGE, "section": [{"title": "s", "rows": v}]}),
    "folder": (
        Rule(lambda v: isinstance(v, str) and "\0" not in v and v not in ("", "..", "/", "c/.."), ("a/c", "/", "c/..")),
        lambda v: {**PAGE, "curve": [{"label": "c", "folder": v}]},
    ),
    "episodes": (each(whole(0, ENDLESS)), lambda v: {**page(ROW), "clips": [{"label": "a", "episodes": v}]}),
}


def page(row, **section):
    return {**PAGE, "section": [{"title": "s", "rows": [row], **section}]}


def as_toml(value):
    """Write a value as TOML; None if TOML has no such value."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int) and abs(value) > 10**4000:
        return "9" * 5000
    if isinstance(value, int | float):
        return f"{value}"
    if isinstance(value, str):
        escaped = "".join(f"\\u{ord(c):04x}" if c < " " or c in '"\\' else c for c in value)
        return f'"{escaped}"'
    if isinstance(value, list | tuple):
        parts = [as_toml(part) for part in value]
        return None if None in parts else f"[{', '.join(parts)}]"
    if isinstance(value, dict):
        parts = {key: as_toml(part) for key, part in value.items()}
        return None if None in parts.values() else "{" + ", ".join(f"{k} = {v}" for k, v in parts.items()) + "}"
    return None


@pytest.mark.parametrize("field", PAGE_TABLES)
def test_a_field_of_a_result_page_takes_what_is_harmless_and_refuses_the_rest_by_name(field, tmp_path):
    rule, contents = PAGE_TABLES[field]
    file, found = tmp_path / "rows.toml", []
    values = {**POOL, **{f"example {place}": value for place, value in enumerate(rule.examples)}}
    for label, value in values.items():
        words = {key: as_toml(part) for key, part in contents(value).items()}
        if None in words.values():
            continue
        file.write_text("".join(f"{key} = {part}\n" for key, part in words.items()))
        name = "rows.toml" if "10^5000" in label else field
        wrong = problem(lambda: read_contents(file), is_harmless=rule.allows(value), name=name)
        if wrong is not None:
            found.append(f"{field} = {label}: {wrong}")
    assert found == [], "\n".join(found)


def faulty(take):
    """A configuration whose only field is taken in a faulty way."""

    class Faulty:
        def __init__(self, size):
            take(size)

    return Faulty


def hang(size):
    while size == 1:
        pass


def refuse(message):
    def take(size):
        raise ConfigurationError(message.format(size=size))

    return take


@pytest.mark.parametrize(
    ("take", "found"),
    [
        (lambda size: None, "size = nan: accepted though harmful"),
        (lambda size: int(size), "size = nan: raw ValueError"),
        (refuse("size={size} is not possible"), "size = 1: refused though harmless"),
        (refuse("this is not possible"), "size = nan: the refusal does not name field and value"),
        (refuse("size is not possible"), "size = nan: the refusal does not name field and value"),
        (hang, "size = 1: hangs"),
    ],
)
def test_a_planted_fault_is_found(monkeypatch, take, found):
    monkeypatch.setattr(field_rules, "CPU_LIMIT_S", 0.1)
    pool = {label: POOL[label] for label in ("1", "nan")}
    monkeypatch.setattr(field_rules, "POOL", pool)
    table = {"size": Rule(whole(0, 9).allows)}
    assert any(line.startswith(found) for line in problems(faulty(take), table, {}))
