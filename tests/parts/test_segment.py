"""Parts of solids: by colour, by shape, one where there is one, and the same however the cloud is turned."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from parts_blocks import body, solid
from scipy.spatial import Delaunay, cKDTree

from steelyard.errors import BadValue
from steelyard.evaluate.segments import score_segments
from steelyard.io.object_folders import read_object
from steelyard.parts.description import cuts_of
from steelyard.parts.doubt import doubts
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.segment import segment
from steelyard.shape.cloud import Cloud
from steelyard.shape.tets import TetMesh
from steelyard.shape.volume import enclose
from steelyard.spatial import Pose, Rotation

STEEL, RUBBER = (150, 152, 156), (50, 50, 52)
MALLET = [((-0.04, -0.02, 0.1), (0.04, 0.02, 0.14)), ((-0.008, -0.008, 0.0), (0.008, 0.008, 0.1))]
ELBOW = [((0, 0, 0), (0.012, 0.012, 0.1)), ((0, 0, 0.1), (0.07, 0.012, 0.112))]


def made(boxes, colours, **options):
    cloud = body(boxes, colours, **options)
    return cloud, solid(cloud, boxes)


def bent(points=1500, seed=0):
    """A round bar with a bend of a quarter circle: a cloud, and a solid."""
    rng = np.random.default_rng(seed)
    straight, radius, thick = 0.06, 0.02, 0.006

    def spine(s):
        turn = np.clip((s - straight) / radius, 0, np.pi / 2)
        rest = np.maximum(s - straight - radius * np.pi / 2, 0)
        x = radius * (1 - np.cos(turn)) + rest
        z = np.minimum(s, straight) + radius * np.sin(turn)
        return np.stack([x, 0 * s, z], axis=1), turn

    length = 2 * straight + radius * np.pi / 2
    ring, cap = rng.uniform(size=(points, 2)), rng.uniform(size=(40, 2))
    s = np.r_[length * ring[:, 0], np.repeat([0, length], 20)]
    r = np.r_[np.full(points, thick), thick * np.sqrt(cap[:, 0])]
    angle = 2 * np.pi * np.r_[ring[:, 1], cap[:, 1]]
    middle, turn = spine(s)
    out = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], axis=1)
    xyz = middle + r[:, None] * (np.cos(angle)[:, None] * out + np.sin(angle)[:, None] * np.array([0, 1, 0]))
    tets = Delaunay(xyz).simplices
    axis = spine(np.linspace(0, length, 400))[0]
    near = cKDTree(axis).query(xyz[tets].mean(1))[0] < thick
    return Cloud(xyz, np.tile(np.uint8(STEEL), (len(xyz), 1))), TetMesh(xyz, tets[near])


def test_two_colours_are_two_parts_that_fill_the_solid():
    cloud, mesh = made(MALLET, [RUBBER, STEEL])
    found = segment(cloud, mesh)
    assert len(found) == len(found.parts) == 2
    assert score_segments(cloud.labels, found.point_part).ari > 0.95
    np.testing.assert_allclose(found.parts.moments.sum(0), mesh.moments(np.zeros(len(mesh)), 1)[0], rtol=1e-9)
    assert found.parts.volume[0] > found.parts.volume[1]
    np.testing.assert_allclose(found.rgb, [RUBBER, STEEL], atol=10)
    assert found.sureness.argmax() == 1
    assert found.sureness.sum() == pytest.approx(1)


def test_a_sliver_that_hangs_free_is_no_part():
    """It is skin all over, as foil is, but weighs nothing, and no neighbour could take it in."""
    cloud, mesh = made(MALLET, [RUBBER, STEEL])
    x, y = np.meshgrid(np.linspace(-0.004, 0.004, 5), np.linspace(-0.004, 0.004, 5))
    sliver = np.stack([x, y, -0.0005 - 0.0002 * (np.arange(25) % 2).reshape(5, 5)], axis=2).reshape(-1, 3)
    tets = Delaunay(sliver).simplices + len(cloud)
    xyz = np.concatenate([cloud.xyz, sliver])
    one = Cloud(xyz, np.concatenate([cloud.rgb, np.tile(np.uint8((200, 30, 30)), (25, 1))]))
    found = segment(one, TetMesh(xyz, np.concatenate([mesh.tets, tets])))
    assert len(found) == 2


def test_a_handle_in_a_head_of_the_same_colour_is_found_by_its_shape():
    cloud, mesh = made(MALLET, [STEEL, STEEL])
    found = segment(cloud, mesh)
    assert len(found) == 2
    assert score_segments(cloud.labels, found.point_part).ari > 0.95


def test_without_colours_shape_alone_decides():
    cloud, mesh = made(MALLET, [STEEL, RUBBER])
    found = segment(Cloud(cloud.xyz), mesh)
    assert len(found) == 2
    assert found.rgb is None
    assert found.parts.rgb is None


def test_a_bend_is_no_seam():
    for cloud, mesh in (bent(), made(ELBOW, [STEEL, STEEL])):
        assert len(segment(cloud, mesh)) == 1


def pipe(outer: float = 0.016, inner: float = 0.013, length: float = 0.15, points: int = 2000, seed: int = 0) -> Cloud:
    """Points evenly over a pipe of one colour, its ends too."""
    rng = np.random.default_rng(seed)
    end = (outer**2 - inner**2) / 2
    face = rng.choice(4, size=points, p=np.array(share := [outer * length, inner * length, end, end]) / sum(share))
    ring = np.sqrt(rng.uniform(inner**2, outer**2, points))
    radius = np.choose(face, [outer, inner, ring, ring])
    height = np.choose(face, [length * rng.uniform(size=points)] * 2 + [np.zeros(points), np.full(points, length)])
    turn = 2 * np.pi * rng.uniform(size=points)
    xyz = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    return Cloud(xyz, np.tile(np.uint8(STEEL), (points, 1)))


@pytest.mark.parametrize("cloud", [pipe(seed=1), pipe(0.02, 0.018)])
def test_a_pipe_is_one_part_though_its_wall_turns_faster_inside(cloud: Cloud) -> None:
    assert len(segment(cloud, enclose(cloud))) == 1


def test_a_bracket_bent_of_sheet_is_one_part():
    boxes = [((0, 0, 0), (0.06, 0.04, 0.002)), ((0, 0, 0.002), (0.002, 0.04, 0.06))]
    cloud, mesh = made(boxes, [STEEL, STEEL])
    assert len(segment(cloud, mesh)) == 1


def test_turned_and_in_another_order_the_parts_are_the_same():
    cloud, mesh = made(MALLET, [RUBBER, STEEL])
    found = segment(cloud, mesh)
    rng = np.random.default_rng(3)
    order, cells = rng.permutation(len(cloud)), rng.permutation(len(mesh))
    pose = Pose(Rotation.exp(rng.normal(size=3)), rng.normal(size=3))
    moved = cloud.in_frame(pose).chosen(order)
    tets = np.argsort(order)[mesh.tets][cells]
    other = segment(moved, TetMesh(moved.xyz, tets))
    assert score_segments(found.point_part[order], other.point_part).ari > 0.99
    again = segment(cloud, TetMesh(mesh.vertices, mesh.tets))
    np.testing.assert_array_equal(found.labels, again.labels)
    np.testing.assert_array_equal(found.hierarchy.merges, again.hierarchy.merges)


def test_bits_of_one_colour_and_walls_that_touch_do_not_hang_on_the_order_of_points():
    # Three like bits of one colour on a body of another: which two join first must not be the one that is listed first.
    boxes = [((0, 0, 0), (0.1, 0.02, 0.02)), *[((x, 0, 0.02), (x + 0.01, 0.02, 0.03)) for x in (0.0, 0.03, 0.09)]]
    cloud, mesh = made(boxes, [STEEL, RUBBER, RUBBER, RUBBER])
    found = segment(cloud, mesh)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        order, cells = rng.permutation(len(cloud)), rng.permutation(len(mesh))
        moved = cloud.chosen(order)
        other = segment(moved, TetMesh(moved.xyz, np.argsort(order)[mesh.tets][cells]))
        for count in (len(found), 2, 3, 4):
            same = score_segments(found.cut(count).point_part[order], other.cut(count).point_part)
            assert same.ari == pytest.approx(1.0)


def test_every_part_has_points_and_each_point_a_part_of_its_colour():
    cloud, mesh = made([((0, 0, 0), (0.1, 0.02, 0.001)), ((0, 0, 0.001), (0.1, 0.02, 0.01))], [RUBBER, STEEL])
    found = segment(cloud, mesh)
    assert len(found) == 2
    assert len(np.unique(found.point_part)) == 2
    assert score_segments(cloud.labels, found.point_part).impurity < 0.01


def test_a_number_in_doubt_is_named_with_what_tells_the_parts_apart():
    merges = np.array([[0, 1], [2, 3]])
    tree = Hierarchy(np.arange(3), merges, np.arange(2.0))
    close, clear = cuts_of(tree, np.array([0.1, 0.1]), 0.1), cuts_of(tree, np.array([0.5, 0.5]), 0.1)
    np.testing.assert_allclose(clear.sureness[1] / clear.sureness[2], np.exp(-4.0))
    assert doubts(clear, np.array([0, 0, 1])) == ()
    (finding,) = doubts(close, np.array([0, 1, 2]))
    assert finding.code == "parts-unsure"
    assert "Only colour tells" in finding.message
    assert "Only shape tells" in doubts(close, np.array([0, 0, 0]))[0].message


def test_scale_changes_nothing():
    cloud, mesh = made(MALLET, [STEEL, STEEL])
    found, large = segment(cloud, mesh), TetMesh(16 * mesh.vertices, mesh.tets)
    np.testing.assert_array_equal(found.labels, segment(Cloud(16 * cloud.xyz, cloud.rgb), large).labels)


def test_bodies_that_do_not_touch_are_parts_under_one_root():
    cloud, mesh = made(
        [((0, 0, 0), (0.02, 0.02, 0.02)), ((0.1, 0, 0), (0.12, 0.02, 0.02))], [STEEL, RUBBER], points=600
    )
    found = segment(cloud, mesh)
    assert len(found) == 2
    assert len(np.unique(found.labels)) == 2
    assert np.isinf(found.hierarchy.cost).sum() == 1


def test_other_numbers_of_parts_names_and_joining():
    cloud, mesh = made(MALLET, [RUBBER, STEEL])
    found = segment(cloud, mesh)
    for count in (1, 2, 3, 5):
        assert len(found.cut(count)) == len(found.cut(count).parts) == count
        assert len(segment(cloud, mesh, parts=count)) == count
    joined = found.cut(3).named(["head", "handle", "rest"]).merged([[1, 2]])
    assert len(joined) == 2
    assert set(joined.names) <= {"head", "handle", "rest"}
    assert joined.parts.volume.sum() == pytest.approx(mesh.volume)
    with pytest.raises(BadValue, match="none twice"):
        found.merged([[0, 1], [1]])
    for wrong in ([0, 1], "ab", [[0.5, 1]]):
        with pytest.raises(BadValue, match=r"lists of parts, such as|must be (whole )?numbers"):
            found.merged(wrong)
    with pytest.raises(BadValue, match=r"of the segmentation's own mesh; got shape \(5,\)"):
        found.with_labels(np.zeros(5, np.int64))
    with pytest.raises(BadValue, match=r"the number of parts must be whole numbers; got 2\.5"):
        found.cut(2.5)
    with pytest.raises(BadValue, match="need as many names"):
        found.named(["one"])
    with pytest.raises(BadValue, match="can be cut into 1 to"):
        found.cut(1000)


def test_a_cloud_in_another_unit_is_refused():
    cloud, mesh = made(MALLET, [RUBBER, STEEL], points=300)
    with pytest.raises(BadValue, match="one frame and unit"):
        segment(Cloud(1000 * cloud.xyz + 5000, cloud.rgb), mesh)


def antichains(tree: Hierarchy, node: int):
    """Every way to cut a node into parts."""
    yield (node,)
    below = tree.children(node)
    if below is not None:
        for one, two in itertools.product(antichains(tree, below[0]), antichains(tree, below[1])):
            yield one + two


def test_cuts_are_the_cheapest_of_all():
    merges = np.array([[0, 1], [2, 3], [4, 6], [5, 7], [8, 9]])
    tree = Hierarchy(np.arange(6), merges, np.arange(5.0))
    for seed in range(20):
        seam = np.random.default_rng(seed).uniform(0, 0.3, 5)
        cuts = cuts_of(tree, seam, 0.1)
        length: dict[int, float] = {}
        for nodes in antichains(tree, tree.root):
            hidden, open_nodes = 0.0, list(nodes)
            while open_nodes:
                node = open_nodes.pop()
                if node >= 6:
                    hidden += seam[node - 6]
                    open_nodes += tree.children(node)
            length[len(nodes)] = min(length.get(len(nodes), np.inf), hidden + 0.1 * len(nodes))
        np.testing.assert_allclose(cuts.length, [length[k] for k in range(1, 7)])
        assert cuts.count == min(length, key=lambda k: length[k])
        assert len(cuts.nodes(cuts.count)) == cuts.count


@pytest.mark.parametrize(
    ("name", "parts", "ari"), [("hammer", 3, 0.75), ("screwdriver", 2, 0.95), ("allen-key", 1, 1.0)]
)
def test_published_objects(data_dir, name, parts, ari):
    known = read_object(data_dir / "workshop-tools" / name)
    cloud = Cloud(known.cloud.xyz, known.cloud.rgb)
    found = segment(cloud, enclose(cloud))
    assert score_segments(known.cloud.labels, found.point_part).ari >= ari
    assert len(found) <= 2 * parts
