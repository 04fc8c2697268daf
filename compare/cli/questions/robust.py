"""``nlp-gait robust``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import end_interrupted, progress_bar, say
from compare.cli.interrupts import kept_in
from compare.cli.options import NaoPhase, Seed
from compare.cli.questions.answers import Output


@command
def robust(
    *,
    mass: Annotated[float, typer.Option(min=0.0, max=50.0, help="Tolerance of every mass, up and down [%].")] = 5.0,
    sole: Annotated[
        float, typer.Option(min=0.0, max=20.0, help="Tolerance of the soles' position in x and y [mm].")
    ] = 2.0,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts of the nominal problem.")] = 10,
    seed: Seed = 0,
    samples: Annotated[
        int, typer.Option(min=0, max=100_000, help="Random corners on which each result is checked.")
    ] = 20,
    simulate: Annotated[bool, typer.Option(help="Play both gaits in MuJoCo on the worst robots (extra sim).")] = True,
    problem: NaoPhase,
    output: Output,
) -> None:
    """Find the least power of a gait that keeps its limits for all masses and soles within their tolerances.

    One motion for all robots of a box, its worst corners found one after the other. Example: `nlp-gait robust nao-ssp`
    """
    from compare.questions.robust.playback import Played, played
    from compare.questions.robust.report import robust_answer
    from compare.questions.robust.study import Robust, boxes
    from compare.questions.robust.study import robust as find
    from compare.study.store import Store

    if simulate:
        from nlp_gait.simulation.engine import load_mujoco

        load_mujoco()
    spec = problem.spec()
    uncertain = boxes(spec, mass / 100.0, sole / 1000.0)
    store = Store(output.out, say)
    store.report_changes("robust", spec.load(), mass=mass, sole=sole, starts=starts, seed=seed, samples=samples)
    found: list[Robust] = []
    runs: tuple[Played, ...] = ()
    stopped = ""
    try:
        with progress_bar("steps", None) as advance:
            for name, box in uncertain.items():
                found.append(
                    find(
                        spec,
                        name,
                        box,
                        starts=starts,
                        seed=seed,
                        samples=samples,
                        store=store,
                        progress=advance,
                    )
                )
            runs = played(spec, found[-1], store, advance) if simulate else ()
    except KeyboardInterrupt:
        stopped = f"interrupted after {len(found)} of {len(uncertain)} boxes"
        if not found:
            end_interrupted(f"{stopped}; {kept_in(output.out)}")
    output.take(robust_answer(problem.name, found, runs), stopped, store)
