"""What of this product the paper's formulas and numbers are asked of.

Formulas are those that a study uses, not written down again.
"""

from spinepipe.muscles.diaphragm import AHEAD_M
from spinepipe.muscles.disc_pressure import PA_PER_MPA, disc_pressure
from spinepipe.muscles.subject import CM_PER_M, REFERENCE
from spinepipe.studies.trunk_loads.ghezelbash_2016.paper import PAPER
from spinepipe.studies.trunk_loads.settings import TrunkLoads
from spinepipe.units import DEG_PER_RAD, MM_PER_M

_AREA_M2 = PAPER["eq_6"]["disc_area_mm2"] / MM_PER_M**2


def by_eq_6(nominal_mpa: float, flexion_deg: float) -> float:
    """Pressure in L4L5, MPa, as a study finds it, of the disc that Eq 6 was fitted to."""
    newton = nominal_mpa * PA_PER_MPA * _AREA_M2
    return disc_pressure(newton, _AREA_M2, flexion_deg / DEG_PER_RAD).pa / PA_PER_MPA


def by_dreischarf(nominal_mpa: float) -> float:
    """The same by Dreischarf 2013, MPa; no flexion takes part."""
    newton = nominal_mpa * PA_PER_MPA * _AREA_M2
    return disc_pressure(newton, _AREA_M2, 0.0).dreischarf_pa / PA_PER_MPA


def asked_of(settings: TrunkLoads) -> dict[str, float]:
    """Settings and numbers of this study that the paper has numbers for, in the paper's units."""
    return {
        "t11t12_bending_percent": 100.0 * (settings.passive.t11t12_bending_factor - 1.0),
        "joints_behind_mm": settings.passive.joints_behind_mm,
        "change_percent": 100.0 * settings.solving.change,
        "pressure_ahead_cm": CM_PER_M * AHEAD_M,
        "reference_male": float(REFERENCE.sex == "male"),
        "reference_age_years": REFERENCE.age_years,
        "reference_height_cm": CM_PER_M * REFERENCE.height_m,
        "reference_mass_kg": REFERENCE.mass_kg,
    }
