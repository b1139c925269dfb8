"""What verification cases measure: checks with bands, balances, exact solutions."""
