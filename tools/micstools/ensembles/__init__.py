"""Many runs of a case: members, machines, tables."""
