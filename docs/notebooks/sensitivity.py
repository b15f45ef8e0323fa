# ruff: noqa: B018
# %% [markdown]
# # Which input moves the result most
#
# Published curves of two L4–L5 discs. Stiffness is known to within 30 %, the load to within 10 %:
# which of them matters for motion in extension?

# %%
import spinepipe as sp

cohort = sp.read_cohort("config/cohorts/l4l5_disc")
factors = {
    "stiffness": {"of": "stiffness", "coordinate": "extension", "times": {"sd": 0.3}},
    "load": {"of": "load_size", "times": {"sd": 0.1}},
}
found = sp.sensitivity(cohort, factors, tests=["extension"], samples=128, outputs=["motion"])
found

# %% [markdown]
# Total indices with their intervals; `dummy` changes nothing and shows what chance makes.

# %%
total = found.table.query("index == 'ST' and coordinate == 'extension'")
total[["specimen", "factor", "estimate", "ci_low", "ci_high", "above_floor"]].round(3)

# %%
found.quality

# %%
print(found.cite())
