"""A belt without motion across itself: a string of mass points, guided along its pitch line.

The pitch line is that of an ideal taut belt: arcs of the pulleys' radii and straight spans. Each of
the n points has one coordinate s along it; joint k is before point k, and c = EA/l its stiffness
with the unstretched length l. With the middles m_k = (s_(k-1) + s_k)/2 the point k stands for the
belt from m_k to m_(k+1), of which the length a_k lies on the arc of a pulley of radius R:

    T_k   = c (s_k - s_(k-1) - l) + b (s_k' - s_(k-1)')
    N_k   = ((T_k + T_(k+1))/2 - m s_k'^2/(m_(k+1) - m_k)) a_k/R,   N_k >= 0
    m s_k'' = T_(k+1) - T_k + sigma F_k,     I omega' = M - R sum F_k
    slip  = R omega - sigma s_k',            |F_k| <= mu N_k

where sigma is +1 where the belt passes the pulley counter-clockwise, else -1, and F_k the friction,
by the same laws as for bodies in the plane [1]_. In full slip this is the equation of Euler and
Eytelwein, in creep that of Reynolds, both to second order in l.

There is no bending, weight, vibration across the belt, sag, lift-off from a pulley, or penetration
of a contact. Where the belt would have to leave its line, its normal force is zero and a joint
under pressure pushes: the run warns of both.

    moreau          steps of a fixed length
    model           from a scenario to arrays, at rest
    observer        what is recorded

The search for who is near a pulley and the rates of a state are in `kernels`, beside those of
bodies in the plane.

References
----------
.. [1] M. J. Leamy, T. M. Wasfy, "Analysis of belt-drive mechanics using a creep-rate-dependent
   friction law", Journal of Applied Mechanics 69(6), 2002.
"""
