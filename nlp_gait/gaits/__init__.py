"""The gait problems that come with the package, a family a folder."""
