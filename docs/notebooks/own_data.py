# ruff: noqa: B018
# %% [markdown]
# # From a machine's files to a figure
#
# Two made-up L4–L5 segments on a testing machine. The settings beside the files say what their
# columns are; with your own files, change those.

# %%
import spinepipe as sp

cohort = sp.import_machine("docs/examples/testing_machine/rig.yaml", accuracy_deg=0.1)
sp.check(cohort)

# %% [markdown]
# Nothing is wrong with the files. What was measured, as arrays with units:

# %%
cohort.data["extension_deg"].sizes, cohort.data["extension_deg"].attrs

# %%
fit = sp.calibrate(cohort, free=["extension", "right_bending"], leave_out=None)
fit

# %% [markdown]
# The first check says whether a linear joint is enough. Measured and predicted motion:

# %%
ax = sp.plot.curves(cohort, "flexion_extension", predicted=fit.predicted)

# %% [markdown]
# It is not. What is missing? All effects are tried.

# %%
found = sp.find_missing_effects(cohort)
found

# %% [markdown]
# With it in the model, the curve bends as the joint does:

# %%
better = sp.simulate(found.model, cohort)
ax = sp.plot.curves(cohort, "flexion_extension", predicted=better)

# %% [markdown]
# For the paper:

# %%
print(found.cite())
