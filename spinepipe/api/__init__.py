"""What a notebook asks: data in, data out, by the functions that the jobs of a run call.

Everything outside is in the units of the files: mm and degrees, N and N m, stiffness in N/m and
N m/rad. `spinepipe` itself offers what is public here.
"""
