"""What limits accuracy, before flight and after: information, considered numbers, bias of wrong models, sampling."""
