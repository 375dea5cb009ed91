#!/usr/bin/env python3
"""Error of full multigrid after each cycle, in a bar with a hat function on one side: draws cycles.svg, prints the errors.

The components are those of crates/cagework-core/src/solve/multigrid.rs: red-black Gauss-Seidel, restriction from red cells,
injection on the finest level from the second cycle on, trilinear prolongation to black cells. Needs NumPy.
"""

from pathlib import Path

import numpy as np

BAR = (16, 16, 128)  # Cells: a limb of a cage. Halved twice.
CYCLES = 5
INNER = (slice(1, -1),) * 3


def colours_of(u):
    parity = np.indices([x - 2 for x in u.shape]).sum(axis=0) + 3
    return parity % 2 == 0, parity % 2 == 1


def around(u):
    """Sum of the six neighbours."""
    return (
        u[2:, 1:-1, 1:-1] + u[:-2, 1:-1, 1:-1] + u[1:-1, 2:, 1:-1]
        + u[1:-1, :-2, 1:-1] + u[1:-1, 1:-1, 2:] + u[1:-1, 1:-1, :-2]
    )


def sweep(u, f, omega=(1.0, 1.0)):
    """Relaxes red cells, then black cells."""
    for colour, factor in zip(colours_of(u), omega):
        change = (around(u) + f) / 6 - u[INNER]
        u[INNER][colour] += factor * change[colour]


def restricted(u, f, injects):
    r = np.zeros_like(u)
    r[INNER] = np.where(colours_of(u)[0], around(u) + f - 6 * u[INNER], 0)
    at, low, high = slice(2, -2, 2), slice(1, -3, 2), slice(3, -1, 2)
    if injects:
        return 2 * r[at, at, at]
    edges = sum(r[a, b, at] + r[a, at, b] + r[at, a, b] for a in (low, high) for b in (low, high))
    return r[at, at, at] / 2 + edges / 8


def interpolated(coarse):
    fine = np.zeros([2 * x - 1 for x in coarse.shape])
    fine[::2, ::2, ::2] = coarse
    fine[1::2] = (fine[:-1:2] + fine[2::2]) / 2
    fine[:, 1::2] = (fine[:, :-1:2] + fine[:, 2::2]) / 2
    fine[:, :, 1::2] = (fine[:, :, :-1:2] + fine[:, :, 2::2]) / 2
    return fine


def cycle(u, f, post, omega, injects=False):
    """V(2, post), with the first black half sweep over-relaxed by `omega`."""
    if min(u.shape) <= 5:
        for _ in range(8):
            sweep(u, f, (1.4, 1.4))
        return
    sweep(u, f, (1.0, omega))
    sweep(u, f)
    coarse = np.zeros([(x + 1) // 2 for x in u.shape])
    cycle(coarse, restricted(u, f, injects), post, omega)
    black = colours_of(u)[1]
    u[INNER][black] += interpolated(coarse)[INNER][black]
    for _ in range(post):
        sweep(u, f)


def boundary(n):
    """A bar of n cells, zero on its surface but for a hat function on one side."""
    u = np.zeros([x + 1 for x in n])
    hat = lambda x, middle: np.clip(1 - np.abs(np.linspace(0, x, x + 1) - middle * x) * 8 / n[0] / 2, 0, 1)
    u[0] = np.minimum.outer(hat(n[1], 0.4), hat(n[2], 0.5))
    return u


def solve(post, omega, cycles):
    """The solution after each cycle on the finest level. The first of them completes full multigrid."""
    sizes = [tuple(x // 2**k for x in BAR) for k in (2, 1, 0)]
    u = None
    for n in sizes:
        guess, u = u, boundary(n)
        if guess is not None:
            u[INNER] = interpolated(guess)[INNER]
        if n != BAR:
            cycle(u, 0, post, omega)
    for k in range(cycles):
        cycle(u, 0, post, omega, injects=k > 0)
        yield u.copy()


def draw(curves):
    left, top, step, decade = 52, 12, 90, 26
    width, height = left + (CYCLES - 1) * step + 20, top + 9 * decade + 48
    at = lambda k, e: (left + k * step, top + decade * (-2 - np.log10(e)))
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">',
             f'<rect width="{width}" height="{height}" fill="white"/>']
    for power in range(-2, -12, -1):
        x, y = at(0, 10.0**power)
        lines.append(f'<path d="M{x} {y:.0f}H{width - 20}" stroke="#ddd"/><text x="{x - 6}" y="{y + 4:.0f}" text-anchor="end">1e{power}</text>')
    for k in range(CYCLES):
        lines.append(f'<text x="{left + k * step}" y="{height - 24}" text-anchor="middle">{k + 1}</text>')
    lines.append(f'<text x="{(left + width - 20) / 2}" y="{height - 6}" text-anchor="middle">cycles on the finest level</text>')
    for (name, found), look, row in zip(curves, ("#888;6 3", "#b35;2 3", "#06c;none"), range(3)):
        colour, dash = look.split(";")
        stroke = f'fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dash}"'
        points = " ".join("{:.0f},{:.1f}".format(*at(k, e)) for k, e in enumerate(found))
        y = top + 16 + 18 * row
        lines.append(f'<polyline points="{points}" {stroke}/><path d="M{width - 210} {y}h30" {stroke}/><text x="{width - 174}" y="{y + 4}">{name}</text>')
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    *_, exact = solve(2, 1.0, 20)
    curves = []
    for name, post, omega in [("V(2,1)", 1, 1.0), ("V(2,2)", 2, 1.0), ("V(2,1), over-relaxed", 1, 1.2)]:
        found = [np.sqrt(np.mean((u - exact)[INNER] ** 2)) for u in solve(post, omega, CYCLES)]
        curves.append((name, found))
        factors = " ".join(f"{a / b:.0f}" for a, b in zip(found, found[1:]))
        print(f"{name:22}", " ".join(f"{e:.1e}" for e in found), "  factors", factors)
    Path(__file__).with_suffix(".svg").write_text(draw(curves))
