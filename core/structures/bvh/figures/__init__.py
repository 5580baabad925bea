"""What can be said of a finished hierarchy beyond the contract's figures."""
