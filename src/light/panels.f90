!> The surface of a block as flat triangles.
module panels_m
  use kinds_m, only: wp
  use vectors_m, only: norm, cross
  use tet_mesh_m, only: shape_t
  implicit none
  private
  public :: panels_t, surface_panels, split_panels, surface_triangles

  type :: panels_t
    integer :: n = 0
    real(wp), allocatable :: corner(:, :, :)   !! (3, 3, n), counter-clockwise from outside [m]
    real(wp), allocatable :: centre(:, :)      !! (3, n) [m]
    real(wp), allocatable :: normal(:, :)      !! (3, n) outward [-]
    real(wp), allocatable :: area(:)           !! (n) [m2]
  end type panels_t

contains

  !> How many triangles the facets of a shape make.
  pure integer function surface_triangles(shape)
    type(shape_t), intent(in) :: shape

    surface_triangles = size(shape%facet_point) - 2*(size(shape%facet) - 1)
  end function surface_triangles

  !> The facets of a shape, each as a fan of triangles; body axes.
  pure function surface_panels(shape) result(panels)
    type(shape_t), intent(in) :: shape
    type(panels_t) :: panels
    real(wp), allocatable :: corner(:, :, :)
    integer :: f, i, m

    allocate (corner(3, 3, surface_triangles(shape)))
    m = 0
    do f = 1, size(shape%facet) - 1
      associate (point => shape%facet_point(shape%facet(f):shape%facet(f + 1) - 1))
        do i = 2, size(point) - 1
          m = m + 1
          corner(:, :, m) = shape%point(:, [point(1), point(i), point(i + 1)])
        end do
      end associate
    end do
    panels = panels_of(corner)
  end function surface_panels

  !> The same surface, every edge longer than `longest` halved until none is.
  pure function split_panels(panels, longest) result(finer)
    type(panels_t), intent(in) :: panels
    real(wp), intent(in) :: longest   !! [m]; 0: every panel is halved once
    type(panels_t) :: finer
    real(wp), allocatable :: corner(:, :, :), halves(:, :, :)
    integer :: n, m, i, k

    allocate (corner, source=panels%corner)
    do
      n = size(corner, 3)
      allocate (halves(3, 3, 2*n))
      m = 0
      do i = 1, n
        k = longest_edge(corner(:, :, i))
        if (norm(corner(:, next(k), i) - corner(:, k, i)) <= longest) then
          halves(:, :, m + 1) = corner(:, :, i)
          m = m + 1
        else
          associate (a => corner(:, k, i), b => corner(:, next(k), i), &
                     c => corner(:, next(next(k)), i))
            halves(:, 1, m + 1) = a
            halves(:, 2, m + 1) = 0.5_wp*(a + b)
            halves(:, 3, m + 1) = c
            halves(:, 1, m + 2) = 0.5_wp*(a + b)
            halves(:, 2, m + 2) = b
            halves(:, 3, m + 2) = c
          end associate
          m = m + 2
        end if
      end do
      deallocate (corner)
      allocate (corner, source=halves(:, :, :m))
      deallocate (halves)
      if (m == n .or. longest <= 0.0_wp) exit
    end do
    finer = panels_of(corner)
  end function split_panels

  !> Centres, normals and areas of triangles; those without area are left out.
  pure function panels_of(corner) result(panels)
    real(wp), intent(in) :: corner(:, :, :)   !! (3, 3, n) [m]
    type(panels_t) :: panels
    real(wp) :: a(3, size(corner, 3))
    logical :: flat(size(corner, 3))
    integer :: i, m

    do i = 1, size(corner, 3)
      a(:, i) = 0.5_wp*cross(corner(:, 2, i) - corner(:, 1, i), corner(:, 3, i) - corner(:, 1, i))
      flat(i) = .not. norm(a(:, i)) > 0.0_wp
    end do
    m = count(.not. flat)
    allocate (panels%corner(3, 3, m), panels%centre(3, m), panels%normal(3, m), panels%area(m))
    do i = 1, size(corner, 3)
      if (flat(i)) cycle
      panels%n = panels%n + 1
      panels%corner(:, :, panels%n) = corner(:, :, i)
      panels%centre(:, panels%n) = sum(corner(:, :, i), 2)/3.0_wp
      panels%area(panels%n) = norm(a(:, i))
      panels%normal(:, panels%n) = a(:, i)/norm(a(:, i))
    end do
  end function panels_of

  !> The corner of a triangle at which its longest edge begins.
  pure integer function longest_edge(corner)
    real(wp), intent(in) :: corner(3, 3)   !! [m]
    integer :: k

    longest_edge = maxloc([(norm(corner(:, next(k)) - corner(:, k)), k=1, 3)], 1)
  end function longest_edge

  !> The corner after corner k.
  pure integer function next(k)
    integer, intent(in) :: k

    next = 1 + mod(k, 3)
  end function next

end module panels_m
