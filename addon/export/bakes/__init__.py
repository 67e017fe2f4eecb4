"""What bakes are made of: how fine they are, where faces lie in them, and what is kept between exports."""
