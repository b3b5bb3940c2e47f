"""From views of a target to a lens: begin with `calibration`.

Then `model_fitter` (which model), `lens_fit` (its parameters), `bundle_adjustment` (the steps),
and `cross_validation` (what the deviations are worth).
"""
