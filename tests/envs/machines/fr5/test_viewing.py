import numpy as np
import pytest

from lerobot_excav.envs.machines.camera_pictures import visible_groups
from lerobot_excav.envs.machines.fr5.dressing import PEOPLE_GROUP
from lerobot_excav.envs.machines.fr5.features import VIEWS
from lerobot_excav.envs.machines.fr5.geoms import ARM
from lerobot_excav.envs.machines.fr5.mjcf import build_model
from lerobot_excav.envs.machines.fr5.rendering import WorkcellRenderer
from lerobot_excav.envs.machines.fr5.room import build_room
from lerobot_excav.envs.machines.fr5.viewing import WorkcellView
from lerobot_excav.envs.machines.simulator import mujoco

HEIGHT, WIDTH = 240, 320


@pytest.fixture
def view(started):
    view = WorkcellView(started, height=HEIGHT, width=WIDTH)
    yield view
    view.close()


def drawn(view, *, camera="overview"):
    """A picture, and the geom that each of its pixels shows."""
    picture = view.render(camera)
    return picture, view._pictures.geoms(camera, view._groups)


def test_every_camera_shows_another_picture_of_the_asked_size_and_the_same_again(view):
    pictures = {camera: view.render(camera) for camera in VIEWS}
    assert {picture.shape for picture in pictures.values()} == {(HEIGHT, WIDTH, 3)}
    assert len({picture.tobytes() for picture in pictures.values()}) == len(VIEWS)
    for camera, picture in pictures.items():
        assert np.array_equal(view.render(camera), picture)


def test_policies_see_none_of_it_and_move_as_before(started, view):
    """The model for people has the same bodies, masses, joints and contacts; the policies' has none of its geoms."""
    plain, dressed = build_model(), build_room()
    assert not (plain.geom_group == PEOPLE_GROUP).any()
    for name in ("body_mass", "body_inertia", "body_ipos", "jnt_range", "dof_armature", "qpos0"):
        assert np.array_equal(getattr(plain, name), getattr(dressed, name)), name
    touching = (dressed.geom_contype | dressed.geom_conaffinity) != 0
    assert touching.sum() == ((plain.geom_contype | plain.geom_conaffinity) != 0).sum()
    renderer = WorkcellRenderer(started, height=96, width=128)
    before = [renderer.render(camera) for camera in ("main", "top")], renderer.block_pixels()
    view.mark(1)
    for camera in VIEWS:
        view.render(camera)
    after = [renderer.render(camera) for camera in ("main", "top")], renderer.block_pixels()
    renderer.close()
    assert np.array_equal(before[0], after[0])
    assert np.array_equal(before[1], after[1])


def test_the_arm_has_a_body_around_its_plain_links_and_dark_lids(view, started):
    _, geoms = drawn(view)
    model, shown = view._model, set(np.unique(drawn(view)[1])) - {-1}
    bodies = {model.body(model.geom_bodyid[geom]).name for geom in shown}
    assert {"base", "hand", "finger_wide", "finger_narrow", *(f"link{i}" for i in range(1, 6))} <= bodies
    on_arm = [geom for geom in shown if model.body(model.geom_bodyid[geom]).name.startswith("link")]
    assert {int(model.geom_group[geom]) for geom in on_arm} == {PEOPLE_GROUP}
    lids = [g for g in range(model.ngeom) if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_ELLIPSOID]
    assert len(lids) >= 6
    # Wherever the plain arm is, in every view, the dressed one is too: nothing that a policy sees is missing.
    view._groups = visible_groups(ARM.group)
    _, plain = drawn(view)
    is_link = np.isin(model.geom_bodyid[np.maximum(plain, 0)], [model.body(f"link{i}").id for i in range(1, 7)])
    covered = np.isin(geoms, [*on_arm, *np.flatnonzero(model.geom_group == PEOPLE_GROUP)])
    assert covered[is_link & (plain >= 0)].mean() > 0.97


def test_the_dressed_arm_follows_the_joints(view, started):
    before = view.render("overview")
    started.data.joint("j1").qpos = 0.6
    mujoco.mj_forward(started.model, started.data)
    after = view.render("overview")
    assert (before != after).any(axis=-1).mean() > 0.03
    for i in range(1, 7):
        assert view._data.body(f"link{i}").xpos == pytest.approx(started.data.body(f"link{i}").xpos, abs=1e-12)


def test_the_table_has_an_edge_and_a_floor_below_it(view):
    _, geoms = drawn(view)
    names = {view._model.geom(geom).name for geom in np.unique(geoms) if geom >= 0}
    assert {"table_top", "table_band", "floor"} <= names
    assert "table" not in names


def test_table_and_blocks_have_the_colours_of_the_scene(view, started, scene):
    picture, geoms = drawn(view, camera="top")
    for i, rgb in enumerate(scene.block_rgb):
        shown = picture[geoms == view._model.geom(f"block{i}").id]
        if len(shown) > 30:
            usual = np.median(shown, axis=0)
            assert usual @ rgb / np.linalg.norm(usual) / np.linalg.norm(rgb) > 0.97


def test_the_commanded_block_is_framed_and_another_one_that_was_shown_too(view):
    plain = view.render("top").astype(int)
    places = []
    for commanded in range(4):
        view.mark(commanded)
        picture, geoms = drawn(view, camera="top")
        changed = (np.abs(picture.astype(int) - plain) > 12).any(axis=-1)
        block = np.argwhere(geoms == view._model.geom(f"block{commanded}").id).mean(axis=0)
        places.append(np.linalg.norm(np.argwhere(changed).mean(axis=0) - block))
        assert changed.sum() > 20
    assert max(places) < 8.0
    view.mark(0, shown=2)
    both = view.render("top")
    view.mark(0)
    assert (both != view.render("top")).any(axis=-1).sum() > 20


def test_arm_and_blocks_cast_shadows(view):
    lit = view.render("overview").astype(int)
    view._model.light_castshadow[:] = 0
    unshaded = view.render("overview").astype(int)
    assert (lit.sum(axis=-1) < 0.8 * unshaded.sum(axis=-1)).mean() > 0.02
