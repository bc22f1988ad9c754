"""Operations on many servos: profiles, matrix, commissioning, and the reports of jobs."""
