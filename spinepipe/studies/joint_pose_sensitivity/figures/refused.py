"""Ways of fitting that were refused, and why."""

import pandas as pd

from spinepipe.statics.status import Status


def refused(fits: pd.DataFrame) -> dict[str, str]:
    """Message of each method of which every fit was refused, in the order of the table."""
    if fits.empty:
        return {}
    return {
        str(method): "; ".join(dict.fromkeys(rows["message"]))
        for method, rows in fits.groupby("method", sort=False)
        if (rows["status"] == Status.REFUSED.value).all()
    }
