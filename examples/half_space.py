"""
A rough surface pressed flat and sheared
========================================

Two steel surfaces of random heights touch in a small part of their area. The grid of 128 x 128
pixels is one period of a large surface; pressures follow by conjugate gradients and FFT. Under a
growing tangential force the small spots slide first.
"""

import numpy as np

import fecontact as fc
from fecontact.half_space import half_space_contact, half_space_friction
from fecontact.plot import plot_half_space

steel, side, pixels, friction = fc.Material.named("steel"), 1e-3, 128, 0.3

# %%
# Heights with a power law between wavelengths of 1/2 and 1/16 mm, of 0.5 um on average (RMS).
q = pixels * np.hypot(np.fft.fftfreq(pixels)[:, None], np.fft.fftfreq(pixels))
size = np.where((q >= 2.0) & (q <= 16.0), np.maximum(q, 1.0) ** -1.8, 0.0)
phase = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, q.shape)
z = np.fft.ifft2(size * np.exp(1j * phase)).real
z *= 0.5e-6 / z.std()

# %%
# Two such surfaces on each other have twice the compliance of one; the gap is that of both.
contact = half_space_contact(-z, side / pixels, (steel, steel), force=100.0, periodic=True)
print(contact)
share = 100.0 * contact.touching.mean()
print(f"{share:.1f} % of the area touch")

# %%
# Shear up to 0.8 of the force at which all would slide.
most = friction * contact.force
shear = half_space_friction(contact, friction, forces=np.outer([0.4, 0.8], [most, 0.0]))
slides = 100.0 * (1.0 - shear.sticking.sum(axis=(1, 2)) / contact.touching.sum())
print(f"at 0.4 and 0.8 of the largest force {slides[0]:.0f} and {slides[1]:.0f} % of it slide")
plot_half_space(shear, path="half_space.png")
