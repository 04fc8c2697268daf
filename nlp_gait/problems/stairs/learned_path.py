"""Desired angles of both legs from the paper's network in place of the closed form."""

from __future__ import annotations

import casadi as ca
from casadi import DM, MX, SX

from nlp_gait.problems.stairs.formulas.leg_network import leg_rates, leg_vector, trained_path
from nlp_gait.problems.stairs.formulas.planar_biped import LINKS
from nlp_gait.problems.stairs.network import NetworkSettings
from nlp_gait.problems.stairs.robot import toe_foot_biped

# Gradient steps, as printed, at a rate with which every pose of the three planned steps converges within 40 of them; the
# printed 5,000 would take a minute for each rollout, as all of them are counted.
ONLINE = NetworkSettings(rule="gradient", rate=0.3, iterations=100)
LEGS = (("HK", "KA"), ("HK'", "K'A'"))


def learned(desired: MX) -> MX:
    """Desired angles and rates (18, m) of all links along a path, those of thighs and shanks by the network.

    The network learns where the ankle is from the hip; rates follow by differentiating its forward kinematics. It is trained
    anew, pose after pose, in every evaluation: the paper trains online.
    """
    columns = desired.shape[1]
    rows = ca.vertsplit(desired)
    for thigh, shank in LEGS:
        lengths = toe_foot_biped().link(thigh).length_m, toe_foot_biped().link(shank).length_m
        at = [LINKS.index(thigh), LINKS.index(shank)]
        at += [len(LINKS) + i for i in at]
        q, v, velocity = SX.sym("q", 2), SX.sym("v", 2), SX.sym("velocity", 2)
        reached = leg_vector(q, *lengths)
        follow = ca.Function("follow", [q, v], [reached, ca.jtimes(reached, q, v)]).map(columns)
        rates = ca.Function("rates", [q, velocity], [leg_rates(q, velocity, *lengths)]).map(columns)
        train = trained_path(ONLINE.hidden, *lengths, columns, ONLINE.rate, ONLINE.iterations, ONLINE.tolerance_m2)
        targets, velocities = follow(ca.vertcat(*(rows[i] for i in at[:2])), ca.vertcat(*(rows[i] for i in at[2:])))
        angles = train(DM(ONLINE.first_weights), targets)
        for i, row in zip(at, ca.vertsplit(ca.vertcat(angles, rates(angles, velocities))), strict=True):
            rows[i] = row
    return ca.vertcat(*rows)
