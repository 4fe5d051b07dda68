"""Material point method with one velocity field per object."""
