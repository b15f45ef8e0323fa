"""Tables of studies of kind scoliosis; what their columns are stands in tables.csv."""

from spinepipe.schema import declared

LAWS = declared(__file__, "laws")
POPULATION = declared(__file__, "population")
DISPLACEMENTS = declared(__file__, "displacements")
POSITIONS = declared(__file__, "positions")
CURVES = declared(__file__, "curves")
ABSOLUTE_STIFFNESS = declared(__file__, "absolute_stiffness")
CLINICAL = declared(__file__, "clinical")
ACCURACY = declared(__file__, "accuracy")
BY_RANGE = declared(__file__, "by_range")
STATISTICS = declared(__file__, "statistics")
VARIANTS = declared(__file__, "variants")
VARIATION = declared(__file__, "variation")
AGAINST_JALALIAN_2017 = declared(__file__, "against_jalalian_2017")

JALALIAN_2017_COHORTS = ("ais18_phantom", "ais18_phantom_sd07", "ais18_phantom_sd19")
"""Made-up spines with the sex, age, Lenke class and Cobb angle of Table 1 of Jalalian et al. 2017
(doi 10.1007/s11517-016-1576-8): only results of these are set beside its numbers."""

GROUPS = ACCURACY.column("films").allowed

MEASURES = {
    "rotation": ("deg", "rotations of segments since the erect film"),
    "place": ("mm", "distance of vertebrae from their places on the film"),
    "tilt": ("deg", "tilts of vertebrae"),
    "cobb": ("deg", "Cobb angles of the curves"),
    "ferguson": ("deg", "Ferguson angles of the curves"),
}
"""What models and films are compared by."""

RANGES = {"below_0.2": (0.0, 0.2), "0.2_to_0.8": (0.2, 0.8), "0.8_to_1": (0.8, 1.0)}
"""Classes of the size of a rotation over the published end of its side (Jalalian 2017 Fig. 7)."""

BEYOND, EVERY = "beyond", "all"

SINGULAR = "singular"
