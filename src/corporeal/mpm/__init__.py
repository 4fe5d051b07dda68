"""Material point method with one velocity field per object; it could leave and be a package."""
