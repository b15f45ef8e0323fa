"""Finding about ways of fitting: how many fits of the same poses each brings to an end."""

from spinepipe.report.page.results import Results
from spinepipe.report.refused import refused
from spinepipe.studies import JointPoseSensitivity


def methods(study: JointPoseSensitivity, results: Results) -> str:
    """Successful fits of each method, or why methods were not compared."""
    rows = results.table("success_by_method")
    if rows.empty:
        return ""
    why = refused(results.table("method_fits"))
    sums = rows.groupby("method", sort=False)[["successful", "fits", "arrived"]].sum()
    parts = [
        f"{str(method).replace('_', ' ')} not compared ({why[str(method)]})"
        if method in why
        else f"{str(method).replace('_', ' ')} {row['successful']} of {row['fits']} "
        f"(least cost reached: {row['arrived']})"
        for method, row in sums.iterrows()
    ]
    if set(sums.index) <= set(why):
        return f"Methods of fitting were not compared: {'; '.join(dict.fromkeys(why.values()))}."
    return f"Successful fits of the same poses by method: {'; '.join(parts)}."
