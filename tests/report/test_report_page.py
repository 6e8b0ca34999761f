"""The page: it shows the numbers, loads nothing, and no name, however hostile, becomes anything but text."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import Delaunay

from steelyard.errors import BadFile, BadValue
from steelyard.evidence import Evidence, PartMass
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.inertia.solids import box
from steelyard.report import Report, Residuals, Truth, render, scene_of_mesh, scene_of_solid, write_report
from steelyard.report.drawing import drawing, even_ellipsoid
from steelyard.report.markup import measured, script_json, tag, text
from steelyard.report.plots import interval
from steelyard.report.scene import MOST_TRIANGLES
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.tets import TetMesh
from steelyard.spatial import Pose, Rotation
from steelyard.tables.numbers import spread

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(1)>\"'&<!-- ]]> ${title} $title \u202e\u2028\x00"
VOID = {"meta", "link", "input", "br"}


class Page(HTMLParser):
    """Elements with their attributes, text, and scripts of a page; every element must be closed in turn."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.words = ""
        self.scripts: list[str] = []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "script":
            self.scripts.append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts[-1] += data
        else:
            self.words += data

    def count(self, name: str) -> int:
        return sum(element == name for element, _ in self.elements)


def ball(count: int = 120) -> TetMesh:
    points = np.random.default_rng(0).normal(size=(count, 3)) * [0.10, 0.03, 0.02]
    return TetMesh(points, Delaunay(points).simplices)


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    body = box(0.02, 0.03, 0.25, 4600).in_frame(Pose(Rotation.exp([0.1, 0.2, 0.3]), np.array([0.01, 0, 0.15])))
    covariance = np.diag([1e-6, *[4e-10] * 3, *[1e-11] * 6])
    evidence = Evidence(
        10, 12.3, 1234, 640, 0.1, 0.01, chi2_per_dof=1.02, holdout_force_N=0.11, holdout_torque_Nm=0.012
    )
    parts = (
        PartMass(0, 0.5, 0.002, 6e-5, np.array([0.0, 0, 0.1]), "steel?"),
        PartMass(1, 0.19, 0.001, 9e-5, np.array([0.0, 0, 0.2]), None),
    )
    found = (Finding.of("outliers", "3 rows were left out."),)
    return Estimate(
        body, covariance, "part-masses", evidence, np.ones(10, np.bool_), wrench_bias=np.arange(6.0),
        bias_covariance=np.eye(6), delays_s={"a.csv": 0.0075}, findings=found, parts=parts, notes=("a note",),
    )  # fmt: skip


@pytest.fixture(scope="module")
def full(estimate: Estimate) -> Report:
    solid, time = ball(), np.arange(500) / 100
    left = np.random.default_rng(1).normal(size=(500, 6))
    cloud = Cloud(solid.vertices, np.random.default_rng(2).integers(0, 256, solid.vertices.shape))
    scene = scene_of_solid(solid, (solid.centroids[:, 0] > 0).astype(int), cloud, None, Pose.identity())
    return Report(
        "A test object", estimate, scene, Residuals(time, left[:, 3:], left[:, :3], time % 2 < 1),
        {"OLS": estimate}, Truth(estimate.parameters, {0: 0.501}), {0: "head"},
        {"command": "steelyard demo", "seed": "7"},
    )  # fmt: skip


def test_the_numbers_stand_there(full: Report) -> None:
    words = Page(render(full)).words.replace("\u202f", " ").replace("\u00a0", " ")
    assert "690.0 ± 1.0 g" in words  # 0.02 * 0.03 * 0.25 * 4600 kg
    for said in ("10.000 ±", "150.00 ±", "head", "500.0 ± 2.0 g", "truth 501.0 g", "steel?", "10 of 10", "12.3", "1234",
                 "1.02", "3 rows were left out.", "Nothing to do if knocks", "a note", "7.50 ms", "OLS"):  # fmt: skip
        assert said in words, said
    assert "steelyard demo" in words


def test_notes_are_a_list_of_their_own(full: Report) -> None:
    """Beside the evidence they made one column of the page twice as long as the other."""
    page = render(full)
    assert '<ul class="notes"><li>a note</li></ul>' in page
    assert ">note</dt>" not in page
    bare = replace(full, estimate=replace(full.estimate, notes=()))
    assert 'class="notes"' not in render(bare)


def test_the_page_loads_nothing(full: Report) -> None:
    text_of_page = render(full)
    assert not re.search(r"(https?:)?//[a-z]", re.sub(r"<script(?s:.)*?</script>", "", text_of_page))
    assert "http" not in text_of_page.replace("http-equiv", "")
    assert not re.search(r"@import|url\((?!#)|fetch\(|XMLHttp|WebSocket|import\(", text_of_page)
    for name, attributes in Page(text_of_page).elements:
        assert "src" not in attributes, name
        assert attributes.get("href") in (None, "data:,"), name


def test_parts_without_a_drawing_stay_whole(full: Report) -> None:
    """In columns a part broke between its name and its bar, and their edges scrolled."""
    style = render(replace(full, scene=None)).split("<style>")[1].split("</style>")[0]
    (alone,) = re.findall(r"\.parts\.alone \.legend{(.*?)}", style)
    assert alone.startswith("display:grid;")
    assert "overflow:visible" in style.split(".parts.alone aside{")[1].split("}")[0]


def test_only_the_pages_own_script_and_style_may_run(full: Report) -> None:
    text_of_page = render(full)
    page = Page(text_of_page)
    policy = next(a["content"] for n, a in page.elements if n == "meta" and "http-equiv" in a) or ""
    style = re.search(r"<style>(.*?)</style>", text_of_page, re.DOTALL)
    assert style is not None
    for kind, source in (("script", page.scripts[-1]), ("style", style[1])):
        digest = base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}'" in policy
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert all("style" not in attributes for _, attributes in page.elements)


def test_hostile_names_stay_text(full: Report, estimate: Estimate) -> None:
    safe = Page(render(full))
    evil = replace(
        estimate, method=HOSTILE, notes=(HOSTILE,), delays_s={HOSTILE: 0.1}, findings=(Finding(*[HOSTILE] * 3),),
        parts=tuple(replace(part, material=HOSTILE) for part in estimate.parts), frame=HOSTILE,
    )  # fmt: skip
    report = replace(full, title=HOSTILE, estimate=evil, rivals={HOSTILE: evil}, names={0: HOSTILE, 1: HOSTILE},
                     provenance={HOSTILE: HOSTILE})  # fmt: skip
    page = Page(render(report))
    assert page.count("script") == safe.count("script") == 2
    assert page.count("img") == 0
    assert not [a for _, attributes in page.elements for a in attributes if a.startswith("on")]
    assert page.scripts[-1] == safe.scripts[-1]
    assert page.words.count("<script>alert(1)</script>") >= 10
    assert "\u202e" not in page.words
    assert "$title" in page.words
    drawn = json.loads(page.scripts[0])
    assert drawn["bodies"][0]["name"] == HOSTILE[:80]
    turned = Page(render(replace(full, names={0: "head \u202ereversed"})))
    assert json.loads(turned.scripts[0])["bodies"][0]["name"] == "head \ufffdreversed"


@given(st.text())
def test_text_comes_back_as_it_was(words: str) -> None:
    class One(HTMLParser):
        found = ""

        def handle_data(self, data: str) -> None:
            self.found += data

    parser = One()
    parser.feed(tag("p", words, title=words))
    parser.close()
    assert parser.found == "".join(c if text(c) != "\ufffd" else "\ufffd" for c in words)[:2000] or "\r" in words


@given(st.recursive(st.text() | st.floats(allow_nan=False, allow_infinity=False), st.lists))
def test_script_json_is_json_without_markup(value: object) -> None:
    said = script_json(value)
    assert json.loads(said) == value
    assert not set(said) & set("<>&\u2028\u2029")


def test_long_texts_are_cut(full: Report) -> None:
    page = render(replace(full, title="x" * 1_000_000))
    assert len(page) < 400_000


def test_a_large_solid_stays_a_small_page(estimate: Estimate) -> None:
    points = np.random.default_rng(0).uniform(-0.1, 0.1, size=(4000, 3))
    solid = TetMesh(points, Delaunay(points).simplices)
    scattered = np.random.default_rng(1).integers(0, 300, len(solid))  # every cell its own island: the worst surface
    cloud = Cloud(np.random.default_rng(2).uniform(-0.1, 0.1, size=(50_000, 3)), None)
    scene = scene_of_solid(solid, np.unique(scattered, return_inverse=True)[1], cloud, None, Pose.identity())
    assert sum(len(body.triangles) for body in scene.bodies) <= 1.2 * MOST_TRIANGLES
    assert len(render(Report("large", estimate, scene))) < 2_000_000


def test_same_report_same_page(full: Report) -> None:
    assert render(full) == render(full)


def test_what_is_missing_is_left_out(estimate: Estimate) -> None:
    page = Page(render(Report("bare", replace(estimate, parts=(), findings=()))))
    assert page.count("canvas") == 0
    assert page.count("script") == 1
    assert "Nothing to report" in page.words
    assert "Against the truth" not in page.words


def test_signs_are_explained_once_and_only_those_that_are_drawn(full: Report) -> None:
    signs = "the answer two standard deviations either side the truth"
    words = Page(render(full)).words
    for said in ("± is one standard deviation", signs):
        assert words.count(said) == 1, said
    alone = Page(render(replace(full, truth=None))).words
    assert "± is one standard deviation" in alone
    assert signs not in alone
    assert "one standard deviation" not in Page(render(replace(full, estimate=exact(full.estimate)))).words


def exact(estimate: Estimate) -> Estimate:
    return replace(estimate, covariance=np.zeros((10, 10)))


def test_no_line_breaks_between_a_number_and_its_unit() -> None:
    words = Page(measured(401.0, 40.0, "kg mm²")).words
    assert words == "401\u202f±\u202f40\u00a0kg\u00a0mm²"
    assert not set(words) & set(" \t\n")


def test_the_truth_has_the_digits_of_the_answer(full: Report) -> None:
    sharp = replace(full.estimate, covariance=np.diag([3.6e-15, *[4e-16] * 3, *[1e-18] * 6]))
    words = Page(render(replace(full, estimate=sharp))).words.replace("\u202f", " ").replace("\u00a0", " ")
    assert "690.000000 ± 0.000060 g690.0000000.0 σ" in words
    shown = re.findall(r"(\d+[.]\d+) ± [\d.]+ (?:mm|kg mm²)−?(\d+[.]\d+?)(?:0[.]0 σ)", words)
    assert len(shown) == 9
    assert all(found == truth for found, truth in shown)


@pytest.mark.parametrize(
    ("std", "said"), [(0.0999, "0.10"), (2.5e-6, "0.0000025"), (2.5e-11, "2.5e−11"), (0.0, "0.000"), (41.0, "41")]
)
def test_no_spread_is_rounded_to_nothing(std: float, said: str) -> None:
    assert spread(std) == said


def test_the_caption_is_below_the_picture_not_on_it(full: Report) -> None:
    markup = render(full)
    stage, after = markup.index('class="chips"'), markup.index('class="hint"')
    assert markup[stage:after].count("</div>") == 2  # the chips and the stage are closed


def test_the_bar_of_a_part_has_its_colour(full: Report) -> None:
    elements = Page(render(full)).elements
    fills = [a["fill"] for name, a in elements if name == "rect" and a.get("height") == "5" and "fill" in a]
    swatches = [a["fill"] for name, a in elements if name == "rect" and a.get("width") == "12"]
    assert fills == swatches
    assert len(set(fills)) == 2


def test_numbers_above_a_plot_say_what_they_are(full: Report) -> None:
    assert Page(render(full)).words.count("rms") == 2


def test_inertia_that_is_not_fixed_is_not_shown(full: Report, estimate: Estimate) -> None:
    open_estimate = replace(estimate, identified=np.arange(10) < 4)
    words = Page(render(replace(full, estimate=open_estimate, rivals={}))).words
    assert "do not determine the inertia" in words
    assert words.count("not fixed by these data") == 6
    assert "Inertia ellipsoid" not in words


def test_the_card_says_which_entries_of_the_inertia_are_fixed(full: Report, estimate: Estimate) -> None:
    partly = replace(estimate, identified=np.array([True] * 7 + [False, True, False]))
    words = Page(render(replace(full, estimate=partly, rivals={}))).words
    assert "These data determine Ixx, Ixy, Ixz, Iyz (in the table), and not Iyy, Izz; see the findings." in words
    assert "do not determine the inertia" not in words
    assert words.count("not fixed by these data") == 2


def test_the_sensor_frame_keeps_its_name(full: Report) -> None:
    words = Page(render(full)).words
    assert "In the sensor frame S; inertia about the centre of mass." in words
    assert "sensor frame s;" not in words


def test_without_a_pose_only_the_shape_is_drawn(full: Report) -> None:
    assert full.scene is not None
    page = Page(render(replace(full, scene=replace(full.scene, X_SO=None))))
    assert json.loads(page.scripts[0])["marks"] == {}
    assert "Centre of massSensor frame" not in page.words


def test_the_bound_of_every_sample_is_in_the_plot(full: Report) -> None:
    """A single outlier of one sample among many is still visible."""
    assert full.residuals is not None
    force = np.zeros((500, 3))
    force[250, 1] = 4.0
    page = render(replace(full, residuals=replace(full.residuals, force=force)))
    band = re.findall(r'<polygon points="([^"]*)" class="band y"', page)[0]
    places = np.array([pair.split(",") for pair in band.split()], float)
    assert places[:, 1].min() == pytest.approx(50 - 50 / 1.06, abs=0.1)
    assert places[places[:, 1].argmin(), 0] == pytest.approx(250 / 499 * 420, abs=1)


def test_an_answer_that_is_no_body_has_a_page_without_moments_and_marks(full: Report, estimate: Estimate) -> None:
    negative = replace(full, estimate=replace(estimate, parameters=InertialParameters(-estimate.parameters.vector)))
    page = Page(render(negative))
    assert "−690.0" in page.words
    assert "Principal inertianot fixed" in page.words
    assert "Centre of mass" not in re.findall(r'data-show="com"[^>]*>([^<]*)<', render(negative))
    assert json.loads(page.scripts[0])["marks"] == {}
    assert json.loads(Page(render(full)).scripts[0])["marks"] != {}


@pytest.mark.parametrize(("moments", "drawn"), [((2e-3, 2e-3, 1e-3), True), ((2e-3, 1e-3, 5e-4), False)])
def test_an_inertia_that_no_body_has_is_not_offered_as_an_ellipsoid(
    full: Report, estimate: Estimate, moments: tuple[float, ...], drawn: bool
) -> None:
    body = InertialParameters.from_com(0.7, [0, 0, 0.1], np.diag(moments))
    page = render(replace(full, estimate=replace(estimate, parameters=body)))
    assert ('data-show="ellipsoid"' in page) == drawn
    assert ("ellipsoid" in json.loads(Page(page).scripts[0])["marks"]) == drawn


def test_a_plate_is_drawn_as_flat_as_it_is(full: Report, estimate: Estimate) -> None:
    turns = Rotation.exp(np.random.default_rng(0).normal(size=(50, 3))).matrix
    for turn in turns:
        plate = InertialParameters.from_com(0.7, [0, 0, 0.1], turn @ np.diag([1e-3, 2e-3, 3e-3]) @ turn.T)
        half = even_ellipsoid(replace(estimate, parameters=plate))
        if half is not None:  # rounding may make it no body at all
            assert np.linalg.norm(half, axis=1).min() < 1e-6


def test_a_part_without_mass_and_a_sure_direction_are_drawn(full: Report, estimate: Estimate) -> None:
    empty = replace(estimate.parts[0], mass=0.0, std=1e-3)
    directions = np.random.default_rng(0).normal(size=(20, 3))
    for direction in directions:  # of a covariance of rank one rounding may leave less than zero
        covariance = 1e-9 * np.eye(10)
        covariance[1:4, 1:4] = 1e-7 * np.outer(direction, direction)
        seen = replace(estimate, parts=(empty, estimate.parts[1]), covariance=covariance)
        assert full.scene is not None
        drawn = drawing(replace(full, estimate=seen), full.scene)
        assert np.isfinite(drawn["marks"]["spread"]["axes"]).all()
        assert drawn["bodies"][0]["dense"] != drawn["bodies"][1]["dense"]


@pytest.mark.parametrize("turned", [1, -1])
def test_a_sheet_is_drawn_from_either_side(full: Report, turned: int) -> None:
    corners = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, 0.1, 0], [0, 0.1, 0]])
    sheet = TriangleMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])[:, ::turned], np.zeros(2, np.int64))
    assert Page(render(replace(full, scene=scene_of_mesh(sheet)))).count("canvas") == 1


def test_what_is_exact_or_not_fixed_has_no_distance_in_bars(full: Report, estimate: Estimate) -> None:
    off = Truth(box(0.02, 0.03, 0.26, 4600))
    weak = replace(estimate, identified=np.arange(10) < 4)
    rows = re.findall(
        r"not fixed by these data</td><td>[^<]*</td><td>([^<]*)</td>", render(replace(full, estimate=weak, truth=off))
    )
    assert rows == [""] * 6
    exact = Page(render(replace(full, estimate=replace(estimate, covariance=np.zeros((10, 10))), truth=off)))
    assert "given as exact" in exact.words
    assert "σ" not in exact.words
    assert "given as exact" not in Page(render(full)).words


def test_shares_are_drawn_of_two_parts_or_more(full: Report, estimate: Estimate) -> None:
    assert 'class="stack"' in render(full)
    assert 'class="stack"' not in render(replace(full, estimate=replace(estimate, parts=estimate.parts[:1])))


@pytest.mark.parametrize("truth", [-1e6, -10.0, -1.0, 0.0, 2.0, 5.0, 1e6])
def test_the_truth_is_on_the_rail_however_far(truth: float) -> None:
    bar = interval(0.0, 1.0, truth)
    place = float(re.findall(r'x1="([-0-9.]+)%"[^>]*class="truth"', bar)[0])
    assert 2 <= place <= 98
    assert np.sign(place - 50) == np.sign(truth)


def test_numbers_that_are_none_are_refused(full: Report) -> None:
    assert full.residuals is not None
    bad = np.array(full.residuals.force)
    bad[3, 1] = np.nan
    with pytest.raises(BadValue, match=r"force residuals must be finite; 1 entry is not, the first at index \(3, 1\)"):
        replace(full.residuals, force=bad)
    with pytest.raises(BadValue, match=r"residuals need 500 rows of torque; got \(499,\)"):
        replace(full.residuals, torque=full.residuals.torque[:-1])
    with pytest.raises(BadValue, match="covariance must be finite"):
        render(replace(full, estimate=replace(full.estimate, covariance=np.full((10, 10), np.inf))))


def test_a_page_is_written_whole_or_not_at_all(full: Report, tmp_path: Path) -> None:
    write_report(full, tmp_path / "r.html")
    assert (tmp_path / "r.html").read_text(encoding="utf-8") == render(full)
    with pytest.raises(BadFile, match="cannot be written"):
        write_report(full, tmp_path / "no" / "r.html")
    assert [path.name for path in tmp_path.iterdir()] == ["r.html"]
