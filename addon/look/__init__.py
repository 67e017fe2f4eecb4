"""Pictures and words about derivatives: derivative pictures, comparisons with finite differences, plans."""
