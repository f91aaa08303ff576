"""What the case study offers: each name is imported from its module when it is first used."""

from .anova import check_anova as check_anova
from .arithmetic import (
    Check as Check,
    published_checks as published_checks,
)
from .rounding import (
    Printed as Printed,
    recompute as recompute,
)
from .stalks import (
    published_test as published_test,
    ramie as ramie,
    ramie_at_height as ramie_at_height,
)
from .tables import (
    published_table as published_table,
    published_text as published_text,
)
