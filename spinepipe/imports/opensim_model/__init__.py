"""An OpenSim model (`.osim`) as a cohort folder, read without OpenSim."""
