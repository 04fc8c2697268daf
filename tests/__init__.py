"""The project's tests; a package, so that no other package's tests are taken for them."""
