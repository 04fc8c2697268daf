"""Any CasADi function as native code that evaluates batches of rows."""
