"""Preview control: a cart on a table moves so that its ZMP follows a reference that is known in advance.

Source:
    Kajita, Kanehiro, Kaneko, Fujiwara, Harada, Yokoi, Hirukawa (2003), "Biped walking pattern generation by using preview control
    of zero-moment point", ICRA, pages 1620 to 1626: the cart-table model (eqs. 5 and 6), the controller (eqs. 13 to 22) with the
    weights and the preview of its example.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are

from nlp_gait.formulation import Array

PREVIEW_S = 1.6
ERROR_WEIGHT, JERK_WEIGHT = 1.0, 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """Motion of a cart with constant jerk between samples."""

    sample_s: float  # time between samples [s]
    states: Array  # (T, 3) position, velocity and acceleration at each sample [m, s]
    jerks: Array  # (T,) from each sample on [m/s^3]

    def at(self, t: Array) -> Array:
        """Return positions (k,) [m] at times (k,) [s], exact between samples."""
        k = np.clip(np.floor(t / self.sample_s + 1e-9).astype(int), 0, len(self.jerks) - 1)
        since = t - k * self.sample_s
        position, velocity, acceleration = self.states[k].T
        return position + since * (velocity + since * (acceleration / 2 + since * self.jerks[k] / 6))


@dataclass(frozen=True, kw_only=True, eq=False)
class PreviewController:
    """Controller of a cart whose ZMP follows a reference that is known in advance (eqs. 13 to 22)."""

    sample_s: float  # T [s]
    height_m: float  # of the cart [m]
    gravity: float  # [m/s^2]

    def follow(self, reference: Array) -> Course:
        """Return the motion of the cart from rest above the first reference.

        The ZMP's reference (T + preview,) [m] is longer than the motion by ``self.preview`` samples.
        """
        integral_gain, state_gain, preview_gains = self._gains()
        a, b, c = self._cart()
        steps = len(reference) - self.preview
        states, jerks = np.zeros((steps, 3)), np.zeros(steps)
        state, error = np.array([reference[0], 0.0, 0.0]), 0.0
        for k in range(steps):
            error += c @ state - reference[k]
            ahead = preview_gains @ reference[k + 1 : k + 1 + self.preview]
            jerk = -integral_gain * error - state_gain @ state - ahead
            states[k], jerks[k] = state, jerk
            state = a @ state + b * jerk
        return Course(sample_s=self.sample_s, states=states, jerks=jerks)

    @property
    def preview(self) -> int:
        """Number of previewed samples."""
        return math.ceil(PREVIEW_S / self.sample_s)

    def _cart(self) -> tuple[Array, Array, Array]:
        """Matrices of its motion under constant jerk, and row of its ZMP (eq. 6)."""
        t = self.sample_s
        a = np.array([[1.0, t, t**2 / 2], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
        return a, np.array([t**3 / 6, t**2 / 2, t]), np.array([1.0, 0.0, -self.height_m / self.gravity])

    def _gains(self) -> tuple[float, Array, Array]:
        """Gains on the summed error, on the state (3,), and on the next references (preview,)."""
        a, b, c = self._cart()
        whole_b = np.concatenate([[c @ b], b])[:, None]
        unit = np.array([[1.0], [0.0], [0.0], [0.0]])
        rest = np.vstack([c @ a, a])
        whole_a = np.hstack([unit, rest])
        weight = np.diag([ERROR_WEIGHT, 0.0, 0.0, 0.0])
        p = solve_discrete_are(whole_a, whole_b, weight, np.array([[JERK_WEIGHT]]))
        scaled = whole_b.T / (JERK_WEIGHT + whole_b.T @ p @ whole_b)
        gain = scaled @ p @ whole_a
        closed = (whole_a - whole_b @ gain).T
        previews = np.zeros(self.preview)
        effect = -p @ unit
        for k in range(self.preview):
            previews[k] = (scaled @ effect).item()
            effect = closed @ effect
        return (scaled @ p @ unit).item(), (scaled @ p @ rest).ravel(), previews
