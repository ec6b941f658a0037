"""A body on a dry shaft in closed form, with 25 digits, where loads are linear in time.

Forces and couples are linear in time piece by piece, and their arms are constant. Between two
knots, M = M_0 + M_1 t and F = F_0 + F_1 t, and with c = b/I

    rest      the margin s M - r_s |F| is zero at a root of M^2 = r_s^2 F^2, quadratic in t
    sliding   w = w_0 exp(-c t) + integral of exp(-c (t - x)) a(x) dx,  I a = M - s r_k |F|
              q = q_0 + w_0 (1 - exp(-c t))/c + integral of (1 - exp(-c (t - x)))/c a(x) dx

It shares no code with the package, and none with `shaft_reference`.
"""

from itertools import pairwise
from typing import Any, NamedTuple

from mpmath import exp, expm1, findroot, hypot, inf, mp, mpf, quad, sqrt

Table = dict[str, Any]
DIGITS = 25
PARTS = 6  # of a piece, at whose ends the sign of the velocity is looked at


class Line(NamedTuple):
    """A linear function of time: value at zero, slope."""

    zero: Any
    slope: Any

    def __call__(self, t: Any) -> Any:
        return self.zero + self.slope * t


def line(size: Any, begin: Any, end: Any) -> Line:
    """Return a size in a piece; it is a number or {time, value}."""
    if not isinstance(size, dict):
        return Line(mpf(size), mpf(0))
    x, y = [mpf(v) for v in size["time"]], [mpf(v) for v in size["value"]]
    middle = (begin + end) / 2
    if middle <= x[0] or middle >= x[-1]:
        return Line(y[0] if middle <= x[0] else y[-1], mpf(0))
    i = next(i for i, knot in enumerate(x) if knot > middle)
    slope = (y[i] - y[i - 1]) / (x[i] - x[i - 1])
    return Line(y[i] - slope * x[i], slope)


class Piece:
    def __init__(self, scenario: Table, begin: Any, end: Any) -> None:
        total = [[mpf(0), mpf(0)] for _ in "Mxy"]
        journal = scenario["effects"]["shaft_friction"]
        for force in scenario["forces"]:
            x, y = (mpf(component) for component in force["direction"])
            length = hypot(x, y)
            if "cord_radius" in force:
                arm = mpf(force["cord_radius"])
            else:
                assert force.get("point_turns") is False or not any(force["point"])
                px, py = (mpf(component) for component in force["point"])
                arm = (px * y - py * x) / length
            for row, factor in zip(total, (arm, x / length, y / length), strict=True):
                for i, value in enumerate(line(force["size"], begin, end)):
                    row[i] += factor * value
        for couple in scenario["couples"]:
            for i, value in enumerate(line(couple["size"], begin, end)):
                total[0][i] += value
        self.moment, self.x, self.y = (Line(*row) for row in total)
        self.begin, self.end = begin, end
        radius, mu_s, mu_k = (mpf(journal[key]) for key in ("shaft_radius", "mu_s", "mu_k"))
        self.r_s, self.r_k = radius * mu_s / hypot(1, mu_s), radius * mu_k / hypot(1, mu_k)
        self.inertia = mpf(scenario["mechanism"]["inertia"])
        damping = scenario["effects"].get("viscous_damping", {"coefficient": 0.0})
        self.rate = mpf(damping["coefficient"]) / self.inertia

    def force(self, t: Any) -> Any:
        return hypot(self.x(t), self.y(t))

    def margin(self, t: Any, s: int) -> Any:
        return s * self.moment(t) - self.r_s * self.force(t)

    def breakaway(self, begin: Any, s: int) -> Any:
        """Return the first time after which the margin is positive, else inf."""
        tiny = mpf(10) ** (8 - DIGITS) * (1 + self.r_s * self.force(begin))
        squares = (
            [line.slope**2 for line in (self.x, self.y)],
            [line.slope * line.zero for line in (self.x, self.y)],
        )
        a = self.moment.slope**2 - self.r_s**2 * sum(squares[0])
        b = self.moment.slope * self.moment.zero - self.r_s**2 * sum(squares[1])
        c = self.moment.zero**2 - self.r_s**2 * (self.x.zero**2 + self.y.zero**2)
        roots = [begin]
        if a == 0:
            roots += [-c / (2 * b)] if b else []
        elif b * b >= a * c:
            roots += [(-b - sqrt(b * b - a * c)) / a, (-b + sqrt(b * b - a * c)) / a]
        for root in sorted(t for t in roots if begin <= t < self.end):
            beyond = min([t for t in roots if t > root] + [self.end])
            if self.margin((root + beyond) / 2, s) > tiny:
                return root
        return inf

    def after(self, t: Any, state: tuple[Any, Any], end: Any, s: int) -> tuple[Any, Any]:
        """Return angle and velocity at the end of sliding in direction s from a time."""
        q, w = state
        c = self.rate

        def a(x: Any) -> Any:
            return (self.moment(x) - s * self.r_k * self.force(x)) / self.inertia

        h = end - t
        if c == 0:
            return q + w * h + quad(lambda x: (end - x) * a(x), [t, end]), w + quad(a, [t, end])
        return (
            q - w * expm1(-c * h) / c - quad(lambda x: expm1(-c * (end - x)) / c * a(x), [t, end]),
            w * exp(-c * h) + quad(lambda x: exp(-c * (end - x)) * a(x), [t, end]),
        )

    def corner(self) -> Any:
        """Return when the resultant is smallest; its size has a corner there if it is zero."""
        slopes = self.x.slope**2 + self.y.slope**2
        if slopes == 0:
            return self.end
        return -(self.x.slope * self.x.zero + self.y.slope * self.y.zero) / slopes


@mp.workdps(DIGITS)
def closed_form(scenario: Table) -> Table:
    loads = [*scenario["forces"], *scenario["couples"]]
    knots = {
        mpf(t) for load in loads if isinstance(load["size"], dict) for t in load["size"]["time"]
    }
    end = mpf(scenario["solver"]["duration"])
    knots = sorted({t for t in knots if 0 < t < end} | {mpf(0), end})
    pieces = []
    for a, b in pairwise(knots):
        corner = Piece(scenario, a, b).corner()
        cuts = [a, *([corner] if a < corner < b else []), b]
        pieces += [Piece(scenario, x, y) for x, y in pairwise(cuts)]
    q, w = mpf(0), mpf(scenario["mechanism"].get("initial_angular_velocity", 0.0))
    mode = (w > 0) - (w < 0)
    events: list[Any] = []
    for piece in pieces:
        t = piece.begin
        while t < piece.end:
            if mode == 0:
                breakaway = min((piece.breakaway(t, s), s) for s in (1, -1))
                t = min(breakaway[0], piece.end)
                mode = breakaway[1] if breakaway[0] < inf else 0
                if mode:
                    events.append((t, 0, mode, q))
                continue
            t, q, w, stopped = _slide(piece, t, q, w, mode)
            if stopped:
                new = next((s for s in (1, -1) if piece.breakaway(t, s) == t), 0)
                if new != mode:
                    events.append((t, mode, new, q))
                mode = new
    return {
        "events": [[float(t), a, b, float(x)] for t, a, b, x in events],
        "final": [float(q), float(w)],
    }


def _slide(piece: Piece, t: Any, q: Any, w: Any, s: int) -> tuple[Any, Any, Any, bool]:
    """Slide to the end of a piece, or to the stop in it."""
    step = (piece.end - t) / PARTS
    for i in range(PARTS):
        begin = t + i * step
        new_q, new_w = piece.after(begin, (q, w), begin + step, s)
        if s * new_w <= 0 and i + (w != 0) > 0:
            state = (q, w)
            at = findroot(
                lambda x, b=begin, y=state: piece.after(b, y, x, s)[1],
                (begin, begin + step), solver="anderson", tol=1e-36, verify=False,
            )  # fmt: skip
            return at, piece.after(begin, state, at, s)[0], mpf(0), True
        q, w = new_q, new_w
    return piece.end, q, w, False
