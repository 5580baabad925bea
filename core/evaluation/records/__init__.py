"""What is measured: experiments, and the records that come of them."""
