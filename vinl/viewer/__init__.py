"""``vinl play``: the chain live in a browser, on viser. The session that is stepped knows nothing of the browser."""
