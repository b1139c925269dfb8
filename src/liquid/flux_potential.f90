!> Potential on the band: `sum_f k_f (phi_c - phi_nb) = r_c` by conjugate gradients.
!!
!! Red cells, no two of which are neighbours, are eliminated: the unknowns are the black ones, which
!! takes half the iterations of the whole system at the same cost each. All parts of the band go
!! side by side, each with its own coefficients, until each has converged; sums are order-free and
!! need one message for all parts.
module flux_potential_m
  use kinds_m, only: wp
  use flux_band_m, only: flux_band_t
  use exact_sum_m, only: exact_add, exact_totals, no_terms
  use parallel_m, only: halo_exchange, global_max
  implicit none
  private
  public :: solve_potential

  integer, parameter :: worth_threads = 8000   !! cells of a part that several threads share

contains

  !> Solve for the parts that are active; the potential stands in `p`, halo filled, zero elsewhere.
  subroutine solve_potential(tolerance, max_iterations, band, iterations)
    real(wp), intent(in) :: tolerance        !! of the balance of a cell [V]
    integer, intent(in) :: max_iterations
    type(flux_band_t), intent(inout) :: band   !! `largest` returns the rest of the active parts [V]
    integer, intent(out) :: iterations
    logical :: solved(band%parts)
    integer :: c

    iterations = 0
    band%p = 0.0_wp
    solved = band%active(1:band%parts)
    call reduce_to_black(band)
    do
      call drop_converged(tolerance, band)
      if (.not. any(band%active(1:band%parts)) .or. iterations == max_iterations) exit
      call next_direction(iterations == 0, band)
      call halo_exchange(band%p, 1)
      call red_values(.false., band)
      call halo_exchange(band%p, 1)
      call advance(band)
      iterations = iterations + 1
    end do
    band%active(1:band%parts) = solved
    do c = 1, band%parts
      if (.not. solved(c)) cycle
      call put(band%first(2*c), band%first(2*c + 1) - 1, band%at, band%phi, size(band%p), band%p)
    end do
    call halo_exchange(band%p, 1)
    call red_values(.true., band)
    call halo_exchange(band%p, 1)
  end subroutine solve_potential

  !> Right-hand side of the black cells: their own and what the red ones pass on. The potential is
  !! zero.
  subroutine reduce_to_black(band)
    type(flux_band_t), intent(inout) :: band
    integer :: c, l, extent(3)

    call red_values(.true., band)   ! with a potential of zero: r over the diagonal
    call halo_exchange(band%p, 1)
    extent = shape(band%p)
    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      call apply(band%first(2*c), band%first(2*c + 1) - 1, band%at, band%diagonal, size(band%p), &
                 extent(1), extent(1)*extent(2), band%k, band%p, band%s, band%terms)
      band%largest(c) = 0.0_wp
      do l = band%first(2*c), band%first(2*c + 1) - 1
        band%phi(l) = 0.0_wp
        band%r(l) = band%r(l) - band%s(l)
        band%largest(c) = max(band%largest(c), abs(band%r(l)))
      end do
    end do
  end subroutine reduce_to_black

  !> A part has converged when no cell misses more than the tolerance.
  subroutine drop_converged(tolerance, band)
    real(wp), intent(in) :: tolerance
    type(flux_band_t), intent(inout) :: band

    call global_max(band%largest(1:band%parts))
    band%active(1:band%parts) = band%active(1:band%parts) .and. &
                                band%largest(1:band%parts) > tolerance
  end subroutine drop_converged

  !> Next search direction of the black cells, p := r/diagonal + step*p.
  subroutine next_direction(start, band)
    logical, intent(in) :: start
    type(flux_band_t), intent(inout) :: band
    integer :: c, l
    real(wp) :: step

    do c = 1, band%parts
      band%bins(:, c) = no_terms
      if (.not. band%active(c)) cycle
      do l = band%first(2*c), band%first(2*c + 1) - 1
        band%terms(l) = band%r(l)*(band%r(l)/band%diagonal(l))
      end do
      call exact_add(band%terms(band%first(2*c):band%first(2*c + 1) - 1), band%bins(:, c))
    end do
    call exact_totals(band%bins(:, 1:band%parts), band%energy(1:band%parts))
    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      step = 0.0_wp
      if (.not. start) step = band%energy(c)/band%before(c)
      band%before(c) = band%energy(c)
      call turn(band%first(2*c), band%first(2*c + 1) - 1, band%at, band%r, band%diagonal, step, &
                size(band%p), band%p)
    end do
  end subroutine next_direction

  !> Values of the red cells that balance them, with their own r or without.
  subroutine red_values(with_r, band)
    logical, intent(in) :: with_r
    type(flux_band_t), intent(inout) :: band
    integer :: c, extent(3)

    extent = shape(band%p)
    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      call balance(band%first(2*c - 1), band%first(2*c) - 1, band%at, band%r, &
                   merge(1.0_wp, 0.0_wp, with_r), band%diagonal, size(band%p), extent(1), &
                   extent(1)*extent(2), band%k, band%p)
    end do
  end subroutine red_values

  !> One step along the search direction; `largest` is what the cells miss afterwards.
  subroutine advance(band)
    type(flux_band_t), intent(inout) :: band
    integer :: c, extent(3)

    extent = shape(band%p)
    do c = 1, band%parts
      band%bins(:, c) = no_terms
      if (.not. band%active(c)) cycle
      associate (a => band%first(2*c), b => band%first(2*c + 1) - 1)
        call apply(a, b, band%at, band%diagonal, size(band%p), extent(1), extent(1)*extent(2), &
                   band%k, band%p, band%s, band%terms)
        call exact_add(band%terms(a:b), band%bins(:, c))
      end associate
    end do
    call exact_totals(band%bins(:, 1:band%parts), band%energy(1:band%parts))
    do c = 1, band%parts
      if (.not. band%active(c)) cycle
      band%active(c) = band%energy(c) > 0.0_wp   ! else nothing is left but round-off
      if (.not. band%active(c)) cycle
      call move(band%first(2*c), band%first(2*c + 1) - 1, band%at, band%before(c)/band%energy(c), &
                size(band%p), band%p, band%s, band%phi, band%r, band%largest(c))
    end do
  end subroutine advance

  !> p := r/diagonal + step*p at the cells a..b of the list.
  pure subroutine turn(a, b, at, r, diagonal, step, m, p)
    integer, intent(in) :: a, b, at(*), m
    real(wp), intent(in) :: r(*), diagonal(*), step
    real(wp), intent(inout) :: p(m)
    integer :: l

    do l = a, b
      p(at(l)) = r(l)/diagonal(l) + step*p(at(l))
    end do
  end subroutine turn

  !> p := (share*r + sum k p_nb)/diagonal at the cells a..b of the list.
  subroutine balance(a, b, at, r, share, diagonal, m, in_y, in_z, k, p)
    integer, intent(in) :: a, b, at(*), m
    real(wp), intent(in) :: r(*), share, diagonal(*)
    integer, intent(in) :: in_y, in_z     !! steps to the next cell in y and z
    real(wp), intent(in) :: k(m, 3)
    real(wp), intent(inout) :: p(m)
    integer :: l, c

    !$omp parallel do private(c) schedule(static) if (b - a > worth_threads)
    do l = a, b
      c = at(l)
      p(c) = (share*r(l) + ((k(c, 1)*p(c - 1) + k(c + 1, 1)*p(c + 1)) &
                            + (k(c, 2)*p(c - in_y) + k(c + in_y, 2)*p(c + in_y)) &
                            + (k(c, 3)*p(c - in_z) + k(c + in_z, 3)*p(c + in_z))))/diagonal(l)
    end do
  end subroutine balance

  !> s := A p and the terms p*s of its energy at the cells a..b of the list.
  subroutine apply(a, b, at, diagonal, m, in_y, in_z, k, p, s, terms)
    integer, intent(in) :: a, b, at(*), m
    real(wp), intent(in) :: diagonal(*)
    integer, intent(in) :: in_y, in_z
    real(wp), intent(in) :: k(m, 3), p(m)
    real(wp), intent(inout) :: s(*), terms(*)
    integer :: l, c

    !$omp parallel do private(c) schedule(static) if (b - a > worth_threads)
    do l = a, b
      c = at(l)
      s(l) = diagonal(l)*p(c) - ((k(c, 1)*p(c - 1) + k(c + 1, 1)*p(c + 1)) &
                                 + (k(c, 2)*p(c - in_y) + k(c + in_y, 2)*p(c + in_y)) &
                                 + (k(c, 3)*p(c - in_z) + k(c + in_z, 3)*p(c + in_z)))
      terms(l) = p(c)*s(l)
    end do
  end subroutine apply

  !> phi := phi + step*p, r := r - step*s, and the largest |r|.
  pure subroutine move(a, b, at, step, m, p, s, phi, r, largest)
    integer, intent(in) :: a, b, at(*), m
    real(wp), intent(in) :: step, p(m), s(*)
    real(wp), intent(inout) :: phi(*), r(*)
    real(wp), intent(out) :: largest
    integer :: l

    largest = 0.0_wp
    do l = a, b
      phi(l) = phi(l) + step*p(at(l))
      r(l) = r(l) - step*s(l)
      largest = max(largest, abs(r(l)))
    end do
  end subroutine move

  !> Put a list on the grid.
  pure subroutine put(a, b, at, list, m, p)
    integer, intent(in) :: a, b, at(*), m
    real(wp), intent(in) :: list(*)
    real(wp), intent(inout) :: p(m)
    integer :: l

    do l = a, b
      p(at(l)) = list(l)
    end do
  end subroutine put

end module flux_potential_m
