"""Table of studies of kind trunk_loads: the numbers of Ghezelbash 2016 beside ours."""

from spinepipe.tables.shared import against_paper

AGAINST_GHEZELBASH_2016 = against_paper("against_ghezelbash_2016")
