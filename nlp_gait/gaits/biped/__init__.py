"""Gait phases of spatial bipeds, written once for every robot.

From a robot to the first constraint, in reading order:

    Body      the robot: joints, legs, feet, size, motors, and how its joints follow from hip and feet (``body.py``);
              its torques and ZMP (``loads.py``) are functions
    Point     values of variables and parameters by name (``nlp_gait.formulation``)
    Instant   motion of the robot at one instant, then its torques, ZMP and ground wrenches (``samples.py``)
    Phase     single or double support: a plan of instants over a Grid, loads, limits and a goal (``phase.py``)
    Samples   a phase evaluated at all its samples, each once (``samples.py``)
    Limit     adds rows, their parameters and metrics (``limits.py``)
    Goal      what is minimised: power, torques or smoothness (``limits.py``)
    Assembly  objective, rows and metrics of a problem (``nlp_gait.formulation``)

``support_phases.py`` composes a phase, ``cycle.py`` joins both by the switches of ``sequence.py``, ``walk.py`` more phases;
``phase_problem.py`` makes the problem, ``problems.py`` declares the options.
``nao/recorded_phase.py`` is a phase whose joints' motion is recorded.
"""
