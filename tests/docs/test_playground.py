"""The playground in a real browser: its numbers are those of Python, sliders and searches work, and it fits all screens."""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from docs.browser import (
    SCREENS,
    Visit,
    list_accessibility_faults,
    list_wide_parts,
    start_browser,
    visit,
    wait_for_motion,
)
from docs.pages import playground
from nlp_gait import gaitbench
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import Skeleton
from tests.extras import need, need_browser

need("ziglang")
need_browser()
pytestmark = pytest.mark.slow
EQUAL = 1e-9
LARGEST_BYTES = 1_500_000


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with start_browser() as started:
        yield started


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory, browser: Any) -> Path:
    folder = tmp_path_factory.mktemp("generated")
    playground.write_playground(folder)
    playground.write(folder)
    assert "Open the playground" in (folder / "playground" / "index.md").read_text(encoding="utf-8")
    return folder / playground.FOLDER / playground.PAGE


@pytest.fixture(scope="module")
def opened(browser: Any, file: Path) -> Iterator[Visit]:
    with visit(browser, file) as found:
        wait_until(found.page, "document.body.dataset.ready === 'yes'")
        yield found


def wait_until(page: Any, condition: str) -> None:
    """Wait for a condition in JavaScript; polled from here, as the page forbids `eval`."""
    deadline = time.monotonic() + 60
    while not page.evaluate(condition):
        if time.monotonic() > deadline:
            pytest.fail(f"not within 60 s: {condition}")
        time.sleep(0.05)


def draw_points(count: int) -> Array:
    """The best known point and random points of the box."""
    instance = gaitbench.load(playground.ID)
    random = np.random.default_rng(36).uniform(instance.lower, instance.upper, (count, len(instance.names)))
    return np.vstack([instance.best_x, random])


@pytest.mark.commit
def test_objective_violation_and_rows_are_those_of_python(opened: Visit) -> None:
    """More points than one call takes; rows in the order of their names."""
    instance, X = gaitbench.load(playground.ID), draw_points(300)
    found = opened.page.evaluate(
        "(points) => playground.model.evaluate(points).map(({ f, violation }) => [f, violation])", X.tolist()
    )
    np.testing.assert_allclose(np.array(found), np.stack(instance(X), axis=1), rtol=EQUAL, atol=EQUAL)
    rows = opened.page.evaluate("(points) => points.map((x) => playground.model.rows(x))", X[:20].tolist())
    np.testing.assert_allclose(rows, instance.rows(X[:20]), rtol=EQUAL, atol=EQUAL)
    assert opened.page.evaluate("playground.model.facts.rows") == list(instance.row_names)


def test_the_gait_is_that_of_python(opened: Visit) -> None:
    """Joints, soles, centre of mass, zero-moment point, power and margin, frame by frame."""
    problem = gaitbench.load(playground.ID).gait_problem
    dense = problem.dense((playground.FRAMES - 1) // problem.grid.parts)
    assert dense is not None and dense.display.skeleton is not None
    for x in draw_points(2):
        signals = dense.signals(x)
        skeleton: Skeleton = dense.display.skeleton(signals, dense.parameter_values)
        found = opened.page.evaluate("(x) => playground.model.gait(x, 'yours', '')", x.tolist())
        power = np.abs(signals["tau"] * signals["qd"]).sum(axis=1)
        pairs = [
            (found["t"], 1000.0 * skeleton.t),
            (found["com"], 1000.0 * skeleton.com),
            (found["zmp"], 1000.0 * skeleton.zmp),
            (found["margin"], 1000.0 * skeleton.margin()),
            (found["power"], power),
            (found["ground"], 1000.0 * skeleton.ground),
        ]
        for kind in ("limbs", "soles"):
            assert [part["side"] for part in found[kind]] == [part.side for part in getattr(skeleton, kind)]
        pairs += [
            (line["points"], 1000.0 * limb.points) for line, limb in zip(found["limbs"], skeleton.limbs, strict=True)
        ]
        for sole, expected in zip(found["soles"], skeleton.soles, strict=True):
            pairs.append((sole["points"], 1000.0 * expected.corners))
            assert np.array_equal(np.array(sole["supports"], dtype=bool), expected.supports)
        for values, expected_values in pairs:
            np.testing.assert_allclose(values, expected_values, rtol=EQUAL, atol=1e-7)


def test_the_searches_use_the_settings_of_the_package(opened: Visit) -> None:
    """Population and the settings that the page names as the package does."""
    from metaheuristics.algorithms.ant_colony import AntColony
    from metaheuristics.algorithms.genetic import GeneticAlgorithm
    from metaheuristics.algorithms.particle_swarm import ParticleSwarm

    page = opened.page.evaluate("SEARCHES.map(({ make }) => new make(9, new Random(1)))")
    swarm, genetic, ants = ParticleSwarm(), GeneticAlgorithm(), AntColony()
    names = {"inertia": "inertia", "damping": "inertia_damping", "cognitive": "cognitive", "social": "social"}
    names |= {"limit": "velocity_limit", "population": "population"}
    assert {key: page[0][key] for key in names} == {key: getattr(swarm, name) for key, name in names.items()}
    assert (page[1]["population"], page[1]["tournament"]) == (genetic.population, genetic.tournament)
    crossover: Any = genetic.crossover
    assert page[1]["crossover"] == {
        "index": crossover.index,
        "probability": crossover.probability,
        "each": crossover.variable_probability,
    }
    assert page[1]["mutation"] == {"index": genetic.mutation.index, "probability": 1 / 9}  # type: ignore[attr-defined]
    settings = {"population": "population", "size": "archive", "locality": "locality", "spread": "spread"}
    assert {key: page[2][key] for key in settings} == {key: getattr(ants, name) for key, name in settings.items()}


def test_sliders_change_the_numbers_by_keyboard(opened: Visit) -> None:
    page = opened.page
    page.locator("#points button").first.click()
    before = page.inner_text("#summary"), page.evaluate("playground.view.gaits[0].t.at(-1)")
    slider = page.locator("[data-variable=single_support_time_s]")
    slider.focus()
    page.keyboard.press("ArrowRight")
    assert page.inner_text("#summary") != before[0]
    assert page.evaluate("playground.view.gaits[0].t.at(-1)") > before[1]
    x = page.evaluate("playground.x")
    f, violation = (values[0] for values in gaitbench.load(playground.ID)(np.array([x])))
    assert page.inner_text("#summary").startswith(f"{f:.5f} W")
    assert ("not feasible" in page.inner_text("#summary")) == (violation > 0)


def test_the_optimum_is_feasible_and_violations_are_named(opened: Visit) -> None:
    page = opened.page
    page.get_by_role("button", name="Optimum", exact=True).click()
    words = page.inner_text("#summary")
    assert words.startswith("0.84587 W") and "the proven optimum" in words and "all 728 constraints met" in words
    middle = [(v["lower"] + v["upper"]) / 2 for v in page.evaluate("playground.model.variables")]
    page.evaluate("(x) => playground.move(x)", middle)
    assert "not feasible: 1 of 728 constraints violated" in page.inner_text("#summary")
    assert page.inner_text("#constraints tr.violated th") == "mean margin across the foot"


def test_the_race_improves_on_its_start(opened: Visit) -> None:
    """Each search gets its budget, improves, and none beats the proven optimum."""
    page = opened.page
    page.select_option("text=evaluations each", "10000")
    page.click("#race .start")
    wait_until(page, "!playground.race.running && playground.race.evaluations === 30000")
    best = gaitbench.load(playground.ID).best_known
    for run in page.evaluate("playground.race.runs.map(({ history, best }) => ({ history, best }))"):
        values = [power for _, power in run["history"]]
        assert values == sorted(values, reverse=True) and values[-1] == run["best"]["f"] < 0.5 * values[0]
        assert best * (1 - 1e-6) < values[-1] < 1.02 * best and run["best"]["violation"] == 0
    assert page.inner_text("#race .verdict").startswith("Closest: ")
    assert page.locator("#race .chart path").count() == 4  # three searches and the mark
    page.locator("#race tbody button").first.click()
    assert page.evaluate("playground.x") == page.evaluate("playground.race.runs[0].best.x")
    assert float(page.get_attribute("#race .speed", "data-per-second")) > 0


def check_page(opened: Visit, screen: str) -> None:
    """Check width, silence and accessibility; the keyboard reaches every control, and the gait moves."""
    page = opened.page
    wait_for_motion(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= SCREENS[screen][0]
    assert list_wide_parts(page) == []
    assert list_accessibility_faults(page) == []
    controls = "[...document.querySelectorAll('a, button:not(:disabled), input, select, canvas, .chart svg')]"
    count = page.evaluate(f"{controls}.length")
    reached = set()
    for _ in range(count + 1):  # once around, past the page itself (-1)
        page.keyboard.press("Tab")
        reached.add(page.evaluate(f"{controls}.indexOf(document.activeElement)"))
    assert reached - {-1} == set(range(count)) and count > 30
    assert (opened.messages, opened.requests) == ([], [])


@pytest.mark.commit
def test_the_page_fits_a_large_screen(opened: Visit, file: Path) -> None:
    assert file.stat().st_size < LARGEST_BYTES
    check_page(opened, "1280 light")


def test_the_page_fits_a_phone(browser: Any, file: Path) -> None:
    with visit(browser, file, "400 dark") as found:
        wait_until(found.page, "document.body.dataset.ready === 'yes'")
        check_page(found, "400 dark")
