"""Bodies put together piece by piece are those of the long way."""

import numpy as np
import pytest

import fecontact as fc
from fecontact.core.errors import InputError
from fecontact.fem import pair_both_faces, pair_faces
from fecontact.laws import ConstantFriction, LinearContact, SlidingTranslation
from fecontact.reduction import Spring, reduce_bodies

NORMAL, FRICTION = LinearContact(1e8, damping=10.0), ConstantFriction(0.3, smoothing_slope=1e4)


def bodies():
    table = fc.Mesh.grid(np.linspace(0.0, 0.1, 11), np.linspace(0.0, 0.02, 3))
    block = fc.Mesh.grid(np.linspace(0.03, 0.07, 3), np.linspace(0.02, 0.04, 3))
    return {"table": fc.ElasticBody(table, fixed={"bottom": "xy"}), "block": fc.ElasticBody(block)}


def assembled(**contact):
    model = fc.Assembly()
    for (name, body), modes in zip(bodies().items(), (4, 6), strict=True):
        model.add(name, body, modes=modes)
    model.contact("joint", "block.bottom", "table.top", normal=NORMAL, friction=FRICTION, **contact)
    return model


@pytest.mark.parametrize("both", [False, True])
def test_the_system_is_that_of_the_long_way(both):
    model = assembled(both_faces=both, nodes=4)
    spring = Spring("block.top left", "table.top left", stiffness=1e5)
    model.join(spring)
    found = model.system(load=fc.Load(gravity=(0.0, -9.81)), damping=0.01)
    made = bodies()
    pair = (pair_both_faces if both else pair_faces)(made, "block.bottom", "table.top", nodes=4)
    bases = reduce_bodies(made, [pair], [spring], modes={"table": 4, "block": 6}, damping=0.01)
    expected = fc.ContactSystem(
        bodies=bases, links=[spring], load=fc.Load(gravity=(0.0, -9.81)),
        interfaces=[fc.Interface("joint", pair, NORMAL, FRICTION)])
    np.testing.assert_array_equal(found.basis.T, expected.basis.T)
    np.testing.assert_array_equal(found.basis.damping, expected.basis.damping)
    np.testing.assert_array_equal(found.gap, expected.gap)
    state = 1e-6 * np.sin(np.arange(found.size))
    np.testing.assert_array_equal(found.rhs(0.0, state), expected.rhs(0.0, state))


def test_the_other_side_of_what_slides_has_no_contact_nodes():
    model = assembled(sliding=SlidingTranslation(0.1))
    assert not model.interfaces["joint"].pairing.swapped
    # The finer face has them otherwise.
    assert assembled().interfaces["joint"].pairing.swapped
    model.join(Spring("block.top left", direction=(1.0, 0.0), stiffness=1e6), "holder")
    rest = fc.equilibrium(model.system(load=fc.Load(gravity=(0.0, -9.81))), "sliding")
    weight = 9.81 * model.bodies["block"].total_mass
    assert rest.normal_force.sum() == pytest.approx(weight, rel=1e-6)
    assert abs(rest.friction_force.sum()) == pytest.approx(0.3 * weight, rel=1e-3)


def test_mistakes_are_named():
    model = assembled()
    assert "'block', 'table'" in repr(model)
    for mistake, said in (
            (lambda: model.add("block", bodies()["block"]), "'block' is the name of another body"),
            (lambda: model.add("pad", fc.Material()), "ElasticBody"),
            (lambda: model.contact("joint", "block.top", "ground", normal=NORMAL),
             "another interface"),
            (lambda: model.contact("other", "block.bottom", "tabel.top", normal=NORMAL),
             "Interface 'other'.*'tabel.top'.*'table'"),
            (lambda: model.contact("other", "block.bottom", "table.top", normal=3.0), "normal"),
            (lambda: fc.Assembly().system(), "there are no bodies"),
            (lambda: model.system(mods=3), "mods")):
        with pytest.raises((InputError, TypeError), match=said):
            mistake()
