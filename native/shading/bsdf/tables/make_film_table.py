"""Writes film_table.inc: sensitivities of the channels to path differences in thin films.

    python native/shading/bsdf/tables/make_film_table.py        (needs mitsuba, for the CIE's curves)

A film's reflectance is a sum of waves in the frequency of light (shading/bsdf/thin_film.h). Its mean over a channel
weighted by the channel's colour matching function is a sum of values of that function's Fourier transform, at multiples
of the path difference (Belcour and Barla 2017). The curves are the CIE's of 1931 (2 degrees) in linear Rec.709, over
frequencies, scaled so that the transform is 1 at 0. The grid is that of Cycles, since what linear interpolation makes
of it is visible: entry i is for the path difference i / 511 * 60 / (2 pi) micrometres.

The table has the real parts of red, green and blue, then their imaginary parts, RANGE values each.
"""

from __future__ import annotations

from pathlib import Path

import mitsuba
import numpy as np

RANGE, FARTHEST = 512, 60.0
REC709 = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)


def spline(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Natural cubic spline through evenly spaced points; 0 outside."""
    step = x[1] - x[0]
    inner = np.diff(y, 2, axis=0) * 6.0 / step**2
    system = 4.0 * np.eye(len(inner)) + np.eye(len(inner), k=1) + np.eye(len(inner), k=-1)
    bent = np.pad(np.linalg.solve(system, inner), ((1, 1), (0, 0)))
    k = np.clip(((at - x[0]) / step).astype(int), 0, len(x) - 2)
    b = ((at - x[k]) / step)[:, None]
    a = 1.0 - b
    value = a * y[k] + b * y[k + 1] + ((a**3 - a) * bent[k] + (b**3 - b) * bent[k + 1]) * step**2 / 6.0
    return np.where((at >= x[0]) & (at <= x[-1]), value.T, 0.0).T


def table() -> np.ndarray:
    """(6, RANGE) real and imaginary parts of the channels' transforms."""
    mitsuba.set_variant("scalar_rgb")
    wavelengths = np.arange(360.0, 831.0, 5.0)
    curves = np.array([mitsuba.cie1931_xyz(float(one)) for one in wavelengths])
    count = 2 * (RANGE - 1)
    frequencies = np.maximum(np.linspace(0.0, np.pi * (count - 1) / FARTHEST, count), 1e-6)  # 1 / micrometre
    spectra = spline(wavelengths, curves, 1000.0 / frequencies) / frequencies[:, None] ** 2
    channels = REC709 @ np.fft.rfft(spectra, axis=0).T
    channels /= channels[:, :1].real
    return np.concatenate([channels.real, channels.imag])


def main() -> None:
    values = [f"{x:.5f}f" for x in table().ravel()]
    lines = [f"extern const float kFilmSensitivity[{6 * RANGE}] = {{"]
    lines += ["    " + ", ".join(values[k : k + 10]) + "," for k in range(0, len(values), 10)]
    text = "// Written by make_film_table.py.\n" + "\n".join([*lines, "};"]) + "\n"
    Path(__file__).with_name("film_table.inc").write_text(text)


if __name__ == "__main__":
    main()
