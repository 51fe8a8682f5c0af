"""Where the bar is looked at: panels with Lobatto's nodes, and what lies between them."""
