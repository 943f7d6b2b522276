"""Paths as the user of the controller has them: points in the plane, from which errors and previews are worked out here."""

import numpy as np
from scipy.interpolate import CubicSpline

# Elements of the controller's previews.
PREVIEW = 41


class Path:
    """A line with a wanted speed: place, heading and curvature over arc length."""

    def __init__(self, s, x, y, psi, kappa, v_x, closed=False):
        self.s, self.x, self.y, self.psi, self.kappa, self.closed = s, x, y, psi, kappa, closed
        self.v_x = np.broadcast_to(v_x, s.shape).astype(float)
        slowness = 1.0 / self.v_x
        self.time = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(s))])

    @property
    def length(self):
        return self.s[-1]

    def at(self, column, s):
        """A column at arc length `s`; in the next lap of a closed path the heading has turned on."""
        if not self.closed:
            return np.interp(s, self.s, column)
        laps = np.floor(s / self.length)
        turned = laps * (self.psi[-1] - self.psi[0]) if column is self.psi else 0.0
        return np.interp(s - laps * self.length, self.s, column) + turned

    def locate(self, x, y, psi, near):
        """Arc length of the nearest point, looked for from `near` on, lateral and heading error there."""
        s = near
        for _ in range(5):
            heading = self.at(self.psi, s)
            dx, dy = x - self.at(self.x, s), y - self.at(self.y, s)
            along = dx * np.cos(heading) + dy * np.sin(heading)
            e_y = dy * np.cos(heading) - dx * np.sin(heading)
            s += along / (1.0 - self.at(self.kappa, s) * e_y)
        return s, e_y, psi - self.at(self.psi, s)

    def preview(self, s, period):
        """Curvature and speed now and where the reference will be at the next sample times."""
        lap = np.floor(s / self.length) if self.closed else 0.0
        after = np.interp(s - lap * self.length, self.s, self.time) + period * np.arange(PREVIEW)
        if self.closed:
            laps = np.floor(after / self.time[-1])
            ahead = laps * self.length + np.interp(after - laps * self.time[-1], self.time, self.s)
        else:
            ahead = np.interp(after, self.time, self.s)
        return self.at(self.kappa, ahead), self.at(self.v_x, ahead)


def double_lane_change(speed):
    """Y(X) = 4.05/2 (1 + tanh z1) - 5.7/2 (1 + tanh z2) after 40 m of straight."""
    x = np.arange(0.0, 200.0, 0.02)
    y, slope, bend = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
    for width, rate, middle in [(4.05, 2.4 / 25.0, 27.19), (-5.7, 2.4 / 21.95, 56.46)]:
        tanh = np.tanh(rate * (x - 40.0 - middle) - 1.2)
        y += width / 2 * (1 + tanh)
        slope += width / 2 * rate * (1 - tanh**2)
        bend += width / 2 * rate**2 * -2 * tanh * (1 - tanh**2)
    stretch = np.hypot(1.0, slope)
    s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    return Path(s, x, y, np.arctan(slope), bend / stretch**3, speed)


def closed_track(file):
    """A closed track through the points of a file with the columns x, y and v_x, by a periodic cubic spline."""
    rows = [line for line in file.read_text().splitlines() if line and not line.startswith("#")]
    assert rows[0] == "x,y,v_x"
    points = np.array([[float(cell) for cell in row.split(",")] for row in rows[1:]])
    x, y, v_x = points.T
    assert (x[0], y[0]) == (x[-1], y[-1]), "the track is not closed"
    chord = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    line = CubicSpline(chord, np.column_stack([x, y]), bc_type="periodic")
    u = np.linspace(0.0, chord[-1], round(chord[-1] / 0.05))
    place, tangent, bend = line(u), line(u, 1), line(u, 2)
    stretch = np.hypot(*tangent.T)
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))])
    psi = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))
    kappa = (tangent[:, 0] * bend[:, 1] - tangent[:, 1] * bend[:, 0]) / stretch**3
    return Path(s, place[:, 0], place[:, 1], psi, kappa, np.interp(u, chord, v_x), closed=True)
